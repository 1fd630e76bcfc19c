"""Recordings for the Rerun viewer, one module a stage: the only importers of rerun."""
