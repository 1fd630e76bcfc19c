"""Ranges of the sonar that go with the face, planted in the labelled soundings of a simulated session."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipeline.artefacts.from_tables import trajectory_in_target
from pipeline.artefacts.streams import MemoryPart, Stream, point_array
from pipeline.simulation.session import SimulatedSession
from tests.support.effort import often
from tests.support.simulated import calibrated, made, mount_within_its_sigmas, through

Law = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of the incidence (n,) rad and |n_z| (n,) of the face


def by_incidence(incidence: np.ndarray, n_z: np.ndarray) -> np.ndarray:
    """1 at 45°, 0 at right angles."""
    return np.asarray((1 / np.cos(incidence) - 1) / (np.sqrt(2) - 1))


def on_level_faces(incidence: np.ndarray, n_z: np.ndarray) -> np.ndarray:
    """1 on horizontal faces."""
    return (n_z > 0.9).astype(float)


def recorded_too_long(session: SimulatedSession, bias_m: float, law: Law) -> Callable[[str, Any], Any]:
    """The labelled soundings with this much too much range, by the true mount's incidence."""
    seen: dict[str, Any] = {}
    R_body_from_mbes = np.array(session.truth["mbes"]["R_body_from_mbes"])

    def lengthened(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        trajectory = trajectory_in_target(seen["georeference/poses"], seen["segment/target_pose"])
        faces, points = seen["segment/faces"], point_array(columns, "mbes_m")
        normals = faces[[f"normal_{axis}_target_1" for axis in "xyz"]].to_numpy()[columns["face"].astype(int)]
        range_m = np.linalg.norm(points, axis=1)
        _, R_target_from_body = trajectory.poses_at(columns["t_ns"])
        rays = np.einsum("nij,nj->ni", R_target_from_body, points @ R_body_from_mbes.T) / range_m[:, None]
        incidence = np.arccos(np.minimum(-np.sum(rays * normals, axis=1), 1.0))
        longer = 1 + bias_m * law(incidence, np.abs(normals[:, 2])) / range_m
        return columns | {f"{axis}_mbes_m": points[:, k] * longer for k, axis in enumerate("xyz")}

    def changed(key: str, value: Any) -> Any:
        seen[key] = value
        if key != "segment/soundings_labelled":
            return value
        return Stream(tuple(MemoryPart(part.name, lengthened(part.columns)) for part in value.parts))

    return changed


@pytest.mark.parametrize("sign", often([1.0], [1.0, -1.0]))
def test_a_transmitter_whose_place_no_document_tells_is_found_and_allowed_for(errors_of: Any, sign: float) -> None:
    """0.119 m above or below the receiver, known to 6 cm. Nothing is told, and the mount is right."""
    session = made({"mbes": {"projector_offset_m": [0.0, 0.0, sign * 0.119]}}, seed=3)
    unsettled = session.session["mbes"] | {"projector_sigma_m": 0.06}
    found = calibrated(replace(session, session=session.session | {"mbes": unsettled}))
    result = json.loads(found["report/calibration.json"])
    assert result["verdict"] == "accepted"  # so each total sigma of the lever arm is below 5 mm
    assert mount_within_its_sigmas(result, errors_of(result["mbes"], session.truth), 3)
    place = result["warning_codes"].index("error_allowed_for")
    assert ("higher" if sign > 0 else "lower") in result["warnings"][place]


@pytest.mark.thorough
def test_a_bias_of_the_lasers_ranges_is_found_on_tops_and_bottoms(errors_of: Any) -> None:
    """One and a half of its sigma. From the laser's height both the lower blocks' tops and the upper ones' bottoms are
    seen, under whose normals, which point up, the same bias moves points to opposite sides."""
    session = made({"laser": {"incidence_bias_m": 0.0015, "incidence_law": "secant"}}, seed=3)
    found = calibrated(session)
    row = found["adjust/freed"].set_index("unknown").loc["laser_incidence"]
    assert abs(row["value"] + 0.0015) < 0.3 * 0.0015  # beyond 80° the bias grows no more
    result = json.loads(found["report/calibration.json"])
    assert result["verdict"] == "accepted"
    assert mount_within_its_sigmas(result, errors_of(result["mbes"], session.truth), 3)


BIASES = pytest.mark.parametrize(
    ("unknown", "law", "bias_m", "words"),
    [
        ("mbes_incidence", by_incidence, 0.008, "the angle at which it sees a face: at 45° they should be -"),
        ("mbes_level_range", on_level_faces, -0.025, "ranges on horizontal faces: they should be +"),
    ][: often(1, 2)],
)


def test_usual_noise_needs_no_wider_gate(noisy_found: Any) -> None:
    mount = noisy_found["segment/provisional_mount"].iloc[0]
    assert mount["gate_m"] == pytest.approx(max(0.05, 5 * mount["scale_m"]))


@BIASES
def test_a_bias_within_its_sigma_is_found_and_allowed_for(
    noisy: SimulatedSession, noisy_found: Any, errors_of: Any, unknown: str, law: Law, bias_m: float, words: str
) -> None:
    """Two and a half of its sigmas, which is 3 mm and 10 mm: the mount is right, and a warning tells."""
    known = through("segment", noisy_found)
    found = calibrated(noisy, changed=recorded_too_long(noisy, bias_m, law), known=known)
    row = found["adjust/freed"].set_index("unknown").loc[unknown]
    assert abs(row["value"] + bias_m) < 0.1 * abs(bias_m) + 3 * row["sigma"]
    result = json.loads(found["report/calibration.json"])
    assert mount_within_its_sigmas(result, errors_of(result["mbes"], noisy.truth), 3)
    assert any("the mount allows for this" in warning and words in warning for warning in result["warnings"])


@pytest.mark.thorough
@BIASES
def test_a_bias_beyond_its_sigma_is_named_and_estimated_if_it_is_freed(
    noisy: SimulatedSession, noisy_found: Any, errors_of: Any, unknown: str, law: Law, bias_m: float, words: str
) -> None:
    """Seven and a half of its sigmas."""
    bias_m, known = 3 * bias_m, through("segment", noisy_found)
    found = calibrated(noisy, changed=recorded_too_long(noisy, bias_m, law), known=known)
    result = json.loads(found["report/calibration.json"])
    (cause,) = (reason for reason in result["reasons"] if "likely cause" in reason)
    assert words in cause.split("nearly as well")[0]
    pool, known = {"adjust": {"free": [unknown]}}, through("georeference", noisy_found)  # segment, too, adjusts with it
    freed = calibrated(noisy, changed=recorded_too_long(noisy, bias_m, law), pool=pool, known=known)
    result = json.loads(freed["report/calibration.json"])
    one = result["free"][unknown]
    assert one["unit"] == "m"
    assert abs(one["value"] + bias_m) < 4 * one["sigma_total"]
    assert mount_within_its_sigmas(result, errors_of(result["mbes"], noisy.truth), 4)
