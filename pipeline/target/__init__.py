"""The search for the target's pose and the provisional mounts, and the labelling of points by the target's faces."""
