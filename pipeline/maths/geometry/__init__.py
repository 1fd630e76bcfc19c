"""Rotations, poses, planes, geodesy: what every part of the mathematics stands on."""
