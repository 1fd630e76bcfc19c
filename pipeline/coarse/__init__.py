"""Coarse mounts from surveyed marks."""
