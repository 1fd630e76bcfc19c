"""From what a sonar records to points in its frame: beams, refraction, sound-speed casts."""
