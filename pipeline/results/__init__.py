"""Finished runs for people: comparison, history, screen and pages."""
