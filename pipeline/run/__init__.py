"""Run folders: what is out of date and why, stages run and written whole, no result lost."""
