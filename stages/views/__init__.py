"""Recordings for the Rerun viewer, one module for each stage. In the program, only this package imports rerun."""
