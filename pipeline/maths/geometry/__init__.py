"""Rotations, poses, planes and geodesy, which all other parts of the mathematics use."""
