"""Artefacts of the stages: schemas of tables and streams, their catalogue, and their Parquet files."""
