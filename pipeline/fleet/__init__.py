"""Many sessions at a time: the list of them, the processes that calibrate them, and the table of what came out."""
