"""Finished runs for people: their difference, their history, text for the screen, and pages."""
