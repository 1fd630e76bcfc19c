"""Blocks that the settings of several sensors have in common."""
