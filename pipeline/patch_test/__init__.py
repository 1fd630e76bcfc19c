"""The patch test: the sonar's angles by passes over the bottom alone, without a target."""
