"""What a session is judged by beside its sigmas: what its residuals say, and in which words."""
