"""On which side of the boat the target may lie, and passes on both sides."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.checking.track import sees_port
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_models import parse
from tests.support.places import edit, poolcal, simulate
from tests.support.simulated import calibrated, made

MOUNT = {"pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.3, "y_m": 0.2, "z_m": -2.0}
BOTH_WAYS: dict[str, Any] = {"track": {"courses": ["along", "back"], "distances_m": [4.0, 5.0]}}


@pytest.mark.parametrize(
    ("roll_deg", "port"), [(-48.8, False), (-30.1, False), (-29.9, True), (0.0, True), (48.8, True)]
)
def test_a_head_that_looks_to_starboard_hears_nothing_to_port(roll_deg: float, port: bool) -> None:
    settings = made({"track": {"distances_m": [4.0]}}, seed=2).session
    mount = settings["mbes"]["mount"] | {"roll_deg": roll_deg, "pitch_deg": 0.0}
    changed = settings | {"mbes": settings["mbes"] | {"mount": mount}}
    assert sees_port(parse(SessionConfig, changed, "session")) == port


def test_passes_both_ways_are_looked_into_with_a_head_that_hears_both_sides(tmp_path: Path) -> None:
    place = simulate(tmp_path / "session", 4, **BOTH_WAYS, mbes={"mount": MOUNT | {"roll_deg": -1.8}})
    told = poolcal("check", place, "--config", place / "pool.yaml")
    assert "does not look" not in told.out
    edit(place / "session.yaml", "mbes", mount=MOUNT | {"roll_deg": -48.0})
    told = poolcal("check", place, "--config", place / "pool.yaml")
    assert told.out.count("target to port, where the sonar does not look") == 1


@pytest.mark.parametrize(("lost", "expected"), [(1, 1), (3, 1)])
def test_a_pass_back_without_soundings_is_missed_if_the_boat_sounds_on_the_way_back(lost: int, expected: int) -> None:
    session = made(BOTH_WAYS, {"track": {"distances_m": [4.0, 5.0, 6.0, 7.0]}}, seed=4)
    passes, t = calibrated(session, "ingest")["ingest/passes"], session.mbes["t_ns"]
    start, end = passes.loc[lost, ["start_ns", "end_ns"]]
    silent = (t >= start) & (t <= end)
    found = calibrated(session, "ingest", raw={"mbes": {k: v[~silent] for k, v in session.mbes.items()}})
    assert len(found["ingest/unsounded_passes"]) == expected
    back = np.isin(t, t[(t >= passes.loc[1, "start_ns"]) & (t <= passes.loc[1, "end_ns"])])
    back |= (t >= passes.loc[3, "start_ns"]) & (t <= passes.loc[3, "end_ns"])
    only_along = calibrated(session, "ingest", raw={"mbes": {k: v[~back] for k, v in session.mbes.items()}})
    assert only_along["ingest/unsounded_passes"].empty  # it came back with the sonar off, as one does
