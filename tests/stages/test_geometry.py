"""What a session's geometry cannot tell, through all stages: refused or warned, each with its sentence."""

import functools
import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipeline.artefacts.streams import MemoryPart, Stream
from tests.support.effort import often
from tests.support.simulated import calibrated, made, through

WAVES = ("surge", "sway", "heave", "roll", "pitch", "heading")
STILL = {"motion": {name: {"amplitude": 0.0, "period_s": 5.0} for name in WAVES}}


def seeing(*families: str) -> Callable[[str, Any], Any]:
    """The sonar's soundings on these families alone; the table of faces comes before the stream."""
    family = np.empty(0)

    def changed(key: str, value: Any) -> Any:
        nonlocal family
        if key == "segment/faces":
            family = value["family"].to_numpy()
        if key != "segment/soundings_labelled":
            return value
        parts = []
        for part in value.parts:
            rows = np.isin(family[part.columns["face"].astype(int)], families)
            parts.append(MemoryPart(part.name, {name: column[rows] for name, column in part.columns.items()}))
        return Stream(tuple(parts))

    return changed


ALL = ("P1", "P2", "P3", "H")


@functools.lru_cache(maxsize=4)
def labelled(scenario: str, seed: int) -> dict[str, Any]:
    """The artefacts up to the labels, of a scenario as JSON. Nobody changes them."""
    return calibrated(made(json.loads(scenario), seed=seed), "segment")


@pytest.mark.parametrize(
    ("scenario", "families", "accepted", "gap"),
    [
        pytest.param({}, ("P2",), False, "the sonar sees the wall alone", id="wall alone"),
        pytest.param({}, ("P1", "P2", "P3"), None, "no horizontal face is seen by both sensors", id="no H, moving"),
        pytest.param({}, ("P1", "P2", "H"), None, "the sonar sees nothing of the faces on the +y side (P3)", id="side"),
        pytest.param(STILL, ("P1", "P2", "P3"), False, "no horizontal face is seen by both sensors", id="no H, still"),
        pytest.param({"track": {"distances_m": [5.0]}}, ALL, None, "one pass alone has soundings, at 5.0 m", id="pass"),
        pytest.param({"track": {"distances_m": [6.0, 6.0]}}, ALL, None, "all passes lie at 6.0 to 6.0 m", id="far"),
    ][: often(2, 6)],
)
def test_gaps(
    scenario: dict[str, Any], families: tuple[str, ...], accepted: bool | None, gap: str, noisy_found: dict[str, Any]
) -> None:
    """None: whatever the sigmas say, but warned, and with what it comes to."""
    seed = 9 if scenario else 1
    known = labelled(json.dumps(scenario), seed) if scenario else through("segment", noisy_found)
    found = calibrated(made(scenario, seed=seed), changed=seeing(*families), known=known)
    result = json.loads(found["report/calibration.json"])
    if accepted is not None:
        assert (result["verdict"] == "accepted") == accepted
    assert gap in result["geometry"]["advice"]
    assert any(gap in words for words in result["warnings"])
    if result["mbes"]["sigma_mount_total"] is None:
        assert any("no result" in reason and gap in reason for reason in result["reasons"])
    else:
        assert any("total sigmas are up to" in words for words in result["warnings"])
        wide = max(result["mbes"]["sigma_total"]["lever_arm_m"]) > 0.005
        assert not wide or result["verdict"] == "rejected"
        if families == ("P2",):
            assert wide


@pytest.mark.thorough
def test_without_any_swing_of_the_heading_nothing_is_lacking() -> None:
    still = {"motion": {"heading": {"amplitude": 0.0, "period_s": 5.0}}}
    result = json.loads(calibrated(made(still, seed=9))["report/calibration.json"])
    assert (result["verdict"], result["geometry"]["advice"]) == ("accepted", "")


@pytest.mark.parametrize(
    ("unknown", "scenario", "laser", "value"),
    [
        ("mbes_latency", {"mbes": {"latency_s": 0.02}}, {}, 0.02),
        ("projector_z", {"mbes": {"projector_offset_m": [0.0, 0.0, 0.119]}}, {}, 0.119),
        ("sound_speed", {"mbes": {"sound_speed_recorded_m_s": 1504.5}}, {}, 1500 / 1504.5 - 1),
        ("laser_rotation_z", {}, {"yaw_deg": 0.2}, -np.radians(0.2)),
        ("laser_latency", {"laser": {"latency_s": 0.03}}, {}, 0.03),
        ("sound_speed_gradient", {"mbes": {"sound_speed_gradient_1_s": 0.8}}, {}, 0.8),
        ("laser_lever_arm_z", {}, {"z_m": 0.05}, -0.05),
        ("projector_x", {"mbes": {"projector_offset_m": [-0.04, 0.0, 0.0]}}, {}, -0.04),
    ][: often(1, 8)],
)
def test_what_is_wrong_is_found_by_the_simulators_own_sign(
    unknown: str, scenario: dict[str, Any], laser: dict[str, float], value: float
) -> None:
    """Named first of all causes, and of the size that was put in: within 10 %, for it is first order."""
    known = {} if laser else labelled(json.dumps(scenario), 7)
    found = calibrated(made(scenario, seed=7), laser=laser, known=known)
    row = found["adjust/freed"].set_index("unknown").loc[unknown]
    assert abs(row["value"] - value) < 0.1 * abs(value) + 3 * row["sigma"]
    assert abs(row["value"]) > 10 * row["sigma"]
    result = json.loads(found["report/calibration.json"])
    assert result["verdict"] == "rejected"
    (cause,) = (reason for reason in result["reasons"] if "likely cause" in reason)
    words = {"mbes_latency": "the sonar's clock", "laser_latency": "the laser's clock", "sound_speed": "sound speed"}
    words |= {"projector_z": " mm higher than mbes.projector", "projector_x": " mm farther to port than mbes.projector"}
    assert words.get(unknown, "with depth" if "gradient" in unknown else "laser.mount") in cause


@pytest.mark.thorough
def test_an_ins_that_drifts_three_times_as_far_is_named_before_any_mount() -> None:
    figures = {"horizontal_m": 0.015, "vertical_m": 0.02, "roll_pitch_deg": 0.01, "heading_deg": 0.03}
    session = made({"ins": {"drift": {name: 3 * value for name, value in figures.items()}}}, seed=1)
    session = replace(session, session=session.session | {"ins": session.session["ins"] | {"drift": figures}})
    found = json.loads(calibrated(session)["report/calibration.json"])["reasons"]
    (place,) = (k for k, reason in enumerate(found) if reason.startswith("the INS drifts at least 1."))
    assert all(k > place for k, reason in enumerate(found) if reason.startswith("likely cause"))


@pytest.mark.thorough
def test_what_is_freed_is_found_said_and_to_be_corrected(errors_of: Any) -> None:
    """The same 20 ms with the latency free: the mount is right, and still nobody shall sail with that clock."""
    late = {"mbes": {"latency_s": 0.02}}
    session = made(late, seed=7)
    known = through("georeference", labelled(json.dumps(late), 7))
    found = calibrated(session, pool={"adjust": {"free": ["mbes_latency"]}}, known=known)
    result = json.loads(found["report/calibration.json"])
    one = result["free"]["mbes_latency"]
    assert one["unit"] == "s"
    assert abs(one["value"] - 0.02) < 4 * one["sigma_total"] < 0.006
    (reason,) = result["reasons"]
    assert reason.startswith(f"adjust.free found the sonar's clock: its latency is {1000 * one['value']:+.0f}")
    sigma = np.sqrt(np.diag(result["mbes"]["covariance_total"])) * np.repeat([180 / np.pi, 1000.0], 3)
    assert np.all(np.abs(errors_of(result["mbes"], session.truth)) < 5 * sigma)
