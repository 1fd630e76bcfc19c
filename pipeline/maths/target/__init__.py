"""The target: its faces and planes, its pose in a point cloud, and the labelling of points by face."""
