"""What a run folder's results follow from, and how none of them is lost."""
