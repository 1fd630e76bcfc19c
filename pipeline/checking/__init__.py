"""A session looked at before it is calibrated: samples of its files, and one function a question.

``survey`` reads heads, tails and pieces of every file; the questions take what it has seen and return findings, each
one line that names file or sensor, value and remedy. What would follow from a finding is not said again: of a sensor a
week off nobody asks whether it hits the target.
"""
