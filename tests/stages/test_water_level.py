"""A session while the water rises: two sessions at two levels, one after the other, calibrated as one."""

import json
from typing import Any

import numpy as np
import pytest

from pipeline.errors import RawDataError
from tests.support.docks import of_faces
from tests.support.simulated import calibrated, made, mount_within_its_sigmas

LOW_M, RISE_M, MARGIN_M, ABOVE_M = -0.15, 0.4, 0.1, 1.3
FIRST, SECOND = "2026-05-12T08:00:00", "2026-05-12T08:30:00"
DOCK = of_faces(
    {
        "wall": {"corners": [[0, 4, -4], [0, -2, -4], [0, -2, 2], [0, 4, 2]]},
        "south": {"corners": [[0, -2, -4], [2, -4, -4], [2, -4, 2], [0, -2, 2]]},
        "north": {"corners": [[2, 6, -4], [0, 4, -4], [0, 4, 2], [2, 6, 2]]},
    },
    azimuth_deg=163.0,
)
STAFF = [
    ["2026-05-12T07:00:00Z", 3.1], ["2026-05-12T08:15:00Z", 3.1], ["2026-05-12T08:20:00Z", 3.5],
    ["2026-05-12T10:00:00Z", 3.5],
]  # fmt: skip


def at(start_utc: str, level_m: float, seed: int) -> Any:
    """A session of two passes. The boat floats: the simulator's INS is at one height above the water."""
    track = {"distances_m": [4.0, 6.0], "half_length_m": 6.0}
    target = DOCK["target"] | {"water_level_m": level_m}
    return made(DOCK, {"start_utc": start_utc, "target": target, "track": track}, seed=seed)


@pytest.fixture(scope="module")
def rising() -> tuple[Any, dict[str, Any]]:
    one, other = at(FIRST, LOW_M, 1), at(SECOND, LOW_M + RISE_M, 2)
    return one, {
        sensor: {name: np.concatenate([column, other.raw[sensor][name]]) for name, column in columns.items()}
        for sensor, columns in one.raw.items()
    }


def used(found: dict[str, Any], sensor: str, number: int) -> np.ndarray:
    """The heights of a sensor's labelled points in a pass."""
    rows = found["adjust/residuals"]
    return rows.loc[(rows["sensor"] == sensor) & (rows["pass"] == number), "z_target_m"].to_numpy()


BY_TIME = [{"ins_above_water_m": ABOVE_M}, {"readings": STAFF}]


@pytest.mark.parametrize("by_time", BY_TIME, ids=["ins", "staff"])
def test_each_pass_has_points_up_to_its_own_water(rising: Any, by_time: Any, errors_of: Any) -> None:
    session, raw = rising
    of_water = {"water_level_m": LOW_M, "water_by_time": by_time}
    found = calibrated(session, raw=raw, pool={"target": of_water})
    levels = found["segment/water_levels"]["level_m"].to_numpy()
    assert levels == pytest.approx([LOW_M, LOW_M, LOW_M + RISE_M, LOW_M + RISE_M], abs=2e-3)
    lowest = [used(found, "laser", number).min() - level for number, level in enumerate(levels)]
    highest = [used(found, "mbes", number).max() - level for number, level in enumerate(levels)]
    assert lowest == pytest.approx([MARGIN_M] * 4, abs=0.02)  # the INS drifts by millimetres, the residuals' z is noisy
    assert highest == pytest.approx([-MARGIN_M - 0.04] * 4, abs=0.02)  # whole footprints lie below
    result = json.loads(found["report/calibration.json"])
    assert mount_within_its_sigmas(result, errors_of(result["mbes"], session.truth), 4.0)


def test_with_one_level_the_passes_have_points_up_to_that(rising: Any) -> None:
    session, raw = rising
    found = calibrated(session, raw=raw, pool={"target": {"water_level_m": LOW_M}}, until="adjust")
    assert found["segment/water_levels"]["level_m"].tolist() == [LOW_M] * 4
    highest = [used(found, "mbes", number).max() - LOW_M for number in range(4)]
    assert highest == pytest.approx([-MARGIN_M - 0.04] * 4, abs=0.02)


def test_readings_that_end_before_a_pass_at_the_target_end_the_run(rising: Any) -> None:
    session, raw = rising
    of_water = {"water_by_time": {"readings": STAFF[:2]}}  # to 08:15; the second session begins at 08:30
    with pytest.raises(RawDataError, match="do not cover the pass from 2026-05-12T08:30"):
        calibrated(session, raw=raw, pool={"target": of_water}, until="georeference")
