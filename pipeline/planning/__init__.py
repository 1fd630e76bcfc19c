"""What planned passes will give, and what passes lack."""
