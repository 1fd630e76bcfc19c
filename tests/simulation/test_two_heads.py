"""A scenario with several heads: each has its own records, files and truth, and all are in one water."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.session import SimulatedSession, simulate_session, simulate_to_folder

MOUNT = {"roll_deg": -48.8, "pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.30, "y_m": 0.20, "z_m": -2.01}
SECOND = MOUNT | {"roll_deg": -40.0, "x_m": -0.3, "y_m": -0.25}
SMALL: dict[str, Any] = {
    "name": "test",
    "track": {"distances_m": [4.0], "half_length_m": 1.5},
    "laser": {"point_rate_hz": 200.0, "line_rate_hz": 20.0, "format": "las"},
    "ins": {"rate_hz": 50.0},
}


def simulated(mbes: Any) -> SimulatedSession:
    return simulate_session(parse(Scenario, SMALL | {"mbes": mbes}, "test"), 3)


def head(**changed: Any) -> dict[str, Any]:
    return {"mount": MOUNT, "ping_rate_hz": 5.0, **changed}


def test_the_first_head_records_what_it_would_alone() -> None:
    alone, both = simulated(head()), simulated([head(), head(mount=SECOND)])
    for name, values in alone.mbes.items():
        np.testing.assert_array_equal(values, both.mbes[name])
    np.testing.assert_array_equal(alone.laser["x_m"], both.laser["x_m"])
    assert simulated([head()]) .session == alone.session  # a list of one is no list
    assert "heads" not in alone.truth


def test_a_second_head_of_the_same_mount_has_noise_and_a_clock_of_its_own() -> None:
    both = simulated([head(), head()])
    second, pings = both.further["mbes_2"]
    assert not set(second["t_ns"]) & set(both.mbes["t_ns"])
    assert np.all(np.diff(pings["t_ns"]) > 0)
    blocks = both.session["mbes"]
    assert [block["files"] for block in blocks] == [["mbes/*.xtf"], ["mbes_2/*.xtf"]]
    assert blocks[0]["mount"] != blocks[1]["mount"]  # coarse errors have signs of their own


def test_soundings_of_each_head_lie_on_the_wall_with_its_own_true_mount() -> None:
    """Without noise and motion: range times direction, by the truth's own mount, ends at the wall's plane x = 0."""
    quiet = {
        "point_beams": True, "corner_share": 0.0, "outlier_share": 0.0, "surface_share": 0.0, "range_sigma_m": 0.0,
        "angle_sigma_deg": 0.0, "dropped_ping_share": 0.0,
    }  # fmt: skip
    names = ("surge", "sway", "heave", "roll", "pitch", "heading")
    still = {name: {"amplitude": 0.0, "period_s": 5.0} for name in names}
    scenario = parse(Scenario, SMALL | {"motion": still, "mbes": [head(**quiet), head(mount=SECOND, **quiet)]}, "test")
    made = simulate_session(scenario, 3)
    for truth, records in zip(made.truth["heads"], (made.mbes, made.further["mbes_2"][0]), strict=True):
        ranges, angle = records["two_way_time_s"] * 1500.0 / 2, records["angle_rad"]
        own = ranges[:, None] * np.column_stack([np.sin(angle), 0 * angle, -np.cos(angle)])
        body = own @ np.array(truth["R_body_from_mbes"]).T + truth["lever_arm_m"]
        x, y = body[:, 0] - 4.0, body[:, 1]  # of the wall, which the boat passes at 4 m
        on_wall = (np.abs(body[:, 2]) < 5) & (np.abs(x) < 0.05)
        assert on_wall.sum() > 500
        assert np.quantile(np.abs(x[on_wall]), 0.99) < 1e-3  # the floor beside it is as near in places
        assert np.ptp(y[on_wall]) < 0.5  # the fan lies across


def test_each_head_has_a_folder_of_files(tmp_path: Path) -> None:
    heads = [head(), head(format="parquet", mount=dict(SECOND))]
    (tmp_path / "two.yaml").write_text(yaml.safe_dump(SMALL | {"mbes": heads}))
    written = simulate_to_folder(tmp_path / "session", tmp_path / "two.yaml", 3)
    files = sorted(path.relative_to(tmp_path / "session").as_posix() for path in tmp_path.glob("session/*/pass_0.*"))
    assert files == ["laser/pass_0.las", "mbes/pass_0.xtf", "mbes_2/pass_0.parquet"]
    assert written["soundings"] > 0


def test_heads_are_in_one_water() -> None:
    with pytest.raises(ConfigError, match=r"mbes_2\.sound_speed_true_m_s is not that of the first head"):
        simulated([head(), head(sound_speed_true_m_s=1490.0)])


def test_a_fault_names_its_head() -> None:
    with pytest.raises(ConfigError, match=r"mbes_2\.beams = 1"):
        simulated([head(), head(beams=1)])
