"""What stages write: schemas of tables and streams, their catalogue, and Parquet files of them."""
