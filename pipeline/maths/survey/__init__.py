"""Marks surveyed by a total station: adjustment of rigid frames, data snooping."""
