"""The computations of stage georeference: points of both sensors in the pool frame."""
