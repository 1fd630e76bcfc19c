"""Points into the pool frame, as stage georeference places them."""
