"""Points in a sonar's frame from its recorded times and angles: beams, refraction, sound-speed casts."""
