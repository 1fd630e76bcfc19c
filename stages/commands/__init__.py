"""One module a command of ``poolcal``."""
