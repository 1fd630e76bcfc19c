"""The calibrated mount and points in the forms of other programs, and mounts read back from those forms.

``convention`` and ``orders`` are the mathematics of other programs' axes, signs and rotation orders, ``mounting`` is
what is written, ``targets`` has one module a program, and ``registry`` lists them. ``cloud`` writes the points.
"""
