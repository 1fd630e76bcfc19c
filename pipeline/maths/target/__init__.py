"""The target: its faces and planes, where it is in a point cloud, and which point lies on which face."""
