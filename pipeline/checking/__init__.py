"""Checks of a session before its calibration, on samples of its files.

``file_survey`` reads the start, the end and pieces of every file. Each question about the session is then one function.
It takes the surveyed files and yields findings. A finding is one line that names the file or sensor, the value and the
remedy. A question is left out if an earlier finding decides its answer: if a sensor's clock is a week off, no function
checks whether its points hit the target.
"""
