"""Run folders: find the stages that are out of date and why, run them, and replace their results as a whole."""
