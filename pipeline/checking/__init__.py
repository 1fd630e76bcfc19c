"""A session checked before it is calibrated, on samples of its files.

``file_survey`` reads heads, tails and pieces of every file. Each question then is one function: it takes what was
read, and yields findings, each one line that names file or sensor, value and remedy. What would follow from a finding
is not said again: of a sensor whose clock is a week off nobody asks whether it hits the target.
"""
