"""Run folders: which stages are out of date and why; stages run and written whole; no result lost."""
