"""Planes in a point cloud that nobody has drawn: voxels, regions that grow, how flat they are, their outlines."""
