"""The stage of a run that calibrates the laser itself in which it differs from one that calibrates the sonar."""
