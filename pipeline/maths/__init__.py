"""The mathematics: pure functions of numbers, which know nothing of files, settings or tables."""
