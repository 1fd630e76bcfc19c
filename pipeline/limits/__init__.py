"""The limits by which a calibration is judged."""
