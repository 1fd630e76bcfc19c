"""Comparison of a survey software's soundings with a run: whether the calibrated mount was entered rightly."""
