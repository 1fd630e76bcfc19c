"""The sample of points for the provisional adjustment has the size that is meant, however long the stream is."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.adjustment.provisional import READ, SAMPLE, sample_near_target
from pipeline.artefacts.streams import MemoryPart, Stream

CONTEXT = SimpleNamespace(
    target=SimpleNamespace(frame=SimpleNamespace(points_from_pool=lambda points: points)),
    model=SimpleNamespace(bounds=lambda: (np.full(3, -1.0), np.full(3, 1.0))),
)


@pytest.mark.parametrize("total", [50_000, 500_000, 3 * READ])
def test_the_sample_is_as_large_as_meant(total):
    """Every fourth point is far from the target. One hash thins twice."""
    far = np.where(np.arange(total) % 4 == 0, np.float32(9.0), np.float32(0.0))
    zero = np.zeros(total, dtype=np.float32)
    columns = {"t_ns": np.arange(total, dtype=np.int64) * 10_000, "x_pool_m": far, "y_pool_m": zero, "z_pool_m": zero}
    sample = sample_near_target(Stream((MemoryPart("laser_pool", columns),)), "laser_pool", total, CONTEXT)
    assert not np.any(sample["x_pool_m"])
    meant = min(0.75 * total, SAMPLE["laser_pool"])
    assert len(sample["t_ns"]) == pytest.approx(meant, rel=0.02)
