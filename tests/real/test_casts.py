"""A real cast against a decoder of the test's own: two floats a line behind the section."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.readers.casts import read_cast


def test_a_real_cast_against_a_decoder_of_its_own(data: Path) -> None:
    """Two floats a line behind the section; every row within the stated tolerance, by interpolation."""
    path = data / "casts" / "caris" / "cidco_s20200713.svp"
    if not path.is_file():
        pytest.skip(f"no real cast: {path}")
    svp, used = read_cast(path, "a.svp")
    rows = np.array([line.split() for line in path.read_text().splitlines()[3:]], dtype=float)
    assert used["rows"] == len(rows) == 204
    assert used["taken"] == "2020-07-13 07:29:11"
    assert used["place_deg"] == pytest.approx((54 + 18 / 60 + 31.2 / 3600, 11 + 56 / 60 + 51 / 3600))
    depth, speed = np.array(svp).T
    assert (depth[0], depth[-1]) == (rows[:, 0].min(), rows[:, 0].max())
    assert np.all(np.diff(depth) > 0)
    assert len(svp) < len(rows)
    assert used["averaged_m"] == 0.0
    assert np.max(np.abs(np.interp(rows[:, 0], depth, speed) - rows[:, 1])) <= 0.02 + 1e-4
