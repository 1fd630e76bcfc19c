"""Walls and slopes that can serve as a target, found in the laser's points of a session without a target's design."""
