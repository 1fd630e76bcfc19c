"""What a session is judged by beside its sigmas: what its residuals say, and whether its cast is of its water."""
