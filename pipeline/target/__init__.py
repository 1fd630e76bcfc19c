"""Where the target is in the points: its pose, the sensors' provisional mounts, its surface."""
