"""Has the mount moved between two sessions: which errors they share, what is counted, and the three answers."""

import json
from copy import deepcopy
from typing import Any

import numpy as np
import pytest

from pipeline.adjustment.error_sources import ERROR_SOURCES, OWNERS, source_of, stated_of
from pipeline.config.pool import AsBuilt
from pipeline.config.session import Laser, Mbes
from pipeline.config.target import Letters
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.mount_parameters import N_MOUNT
from pipeline.results.movement import movement_between
from pipeline.results.session_estimate import SessionEstimate, session_estimate

RAD_M = np.concatenate([np.full(3, np.radians(0.005)), np.full(3, 5e-4)])  # sigmas from noise
LASER_MOUNT = [f"laser_{kind}_{axis}" for kind in ("rotation", "lever_arm") for axis in "xyz"]
LETTERS = {"a": 8, "b": 3, "c": 1, "e": 0.5, "origin": {"latitude_deg": 36, "longitude_deg": 120, "height_m": 12}}
MOUNT = dict.fromkeys(("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m"), 0.0)


def result(**effects: Any) -> dict[str, Any]:
    """A calibration.json, as far as it is read, with some effects (in sigmas of the noise) by parameter."""
    blocks: dict[str, Any] = {
        owner: {"stated": None if owner == "session" else f"{owner} 1", "effects": {}, "correlation": None}
        for owner in OWNERS
    }
    total = np.diag(RAD_M**2)
    for name, sizes in effects.items():
        column = np.array(sizes) * RAD_M
        blocks[source_of(name).owner]["effects"][name] = column.tolist()
        total += np.outer(column, column)
    adjustment = {
        "R_body_from_mbes": np.eye(3).tolist(),
        "lever_arm_m": [0.3, 0.2, -2.0],
        "mount": MOUNT,
        "covariance": np.diag(RAD_M**2).tolist(),
        "covariance_total": total.tolist(),
    }
    return {
        "methods": {"adjustment": adjustment},
        "systematic": blocks,
        "limits": {"max_sigma_deg": 0.05, "max_sigma_m": 0.005},
    }


def read(content: dict[str, Any]) -> SessionEstimate:
    estimate = session_estimate(json.loads(json.dumps(content)))
    assert estimate is not None
    return estimate


def variances(first: dict[str, Any], second: dict[str, Any]) -> list[float]:
    """Of the difference, in variances of one session's noise."""
    found = movement_between(read(first), read(second)).difference
    return list((found.sigma / RAD_M) ** 2)


def axis(k: int, size: float) -> list[float]:
    return [size if place == k else 0.0 for place in range(N_MOUNT)]


def test_what_is_drawn_anew_adds_and_what_is_shared_cancels() -> None:
    content = result(
        sound_speed=axis(3, 2.0), mbes_latency=axis(4, 3.0), laser_range=axis(3, 5.0), wet_P1_shift=axis(5, 4.0)
    )
    np.testing.assert_allclose(variances(content, content), [2, 2, 2, 2 + 2 * 4, 2 + 2 * 9, 2], rtol=1e-9)
    movement = movement_between(read(content), read(content))
    assert set(movement.own) == {"sound_speed", "mbes_latency"}
    assert set(movement.common) == {"laser_range", "wet_P1_shift"}
    assert movement.differing == ()
    assert movement.mostly[3:5] == ("sound speed", "the sonar's clock")
    assert movement.mostly[0] == movement.mostly[5] == "noise"


@pytest.mark.parametrize(
    ("owner", "name"), [("laser_mount", "laser_lever_arm_x"), ("laser", "laser_range"), ("target", "wet_H_shift")]
)
def test_of_another_thing_they_are_each_session_s_own(owner: str, name: str) -> None:
    first = result(**{name: axis(3, 3.0)})
    second = deepcopy(first)
    second["systematic"][owner]["stated"] = "2"
    assert variances(first, first)[3] == pytest.approx(2)
    assert variances(first, second)[3] == pytest.approx(2 + 2 * 9)
    movement = movement_between(read(first), read(second))
    assert (movement.own, movement.common) == ((name,), ())
    assert len(movement.differing) == 1


def test_what_one_session_estimated_stays_the_other_s_own() -> None:
    """Its error is in the first's covariance then, and has no effect there."""
    first, second = result(), result(sound_speed=axis(3, 2.0))
    assert variances(first, second)[3] == pytest.approx(2 + 4)


def test_the_laser_s_correlated_mount_as_the_total_covariance_has_it() -> None:
    """Own: S Q Sᵀ of both; common: none where both are alike. Q with correlation, one of its sigmas zero."""
    rng = np.random.default_rng(2)
    mixed = rng.normal(size=(6, 6))
    sigma = np.array([1e-4, 2e-4, 0.0, 1e-3, 2e-3, 1e-3])
    correlation = mixed @ mixed.T
    correlation /= np.sqrt(np.outer(np.diag(correlation), np.diag(correlation)))
    correlation[2] = correlation[:, 2] = np.eye(6)[2]
    S = np.eye(6) + 0.1 * rng.normal(size=(6, 6))
    content = result()
    block = content["systematic"]["laser_mount"]
    block["effects"] = {name: (S[:, k] * sigma[k]).tolist() for k, name in enumerate(LASER_MOUNT)}
    block["correlation"] = correlation.tolist()
    Q = correlation * np.outer(sigma, sigma)
    other = deepcopy(content)
    same = movement_between(read(content), read(other)).difference.covariance
    np.testing.assert_allclose(same, 2 * np.diag(RAD_M**2), rtol=1e-9, atol=1e-16)
    other["systematic"]["laser_mount"]["stated"] = "another survey"
    apart = movement_between(read(content), read(other))
    np.testing.assert_allclose(apart.difference.covariance, 2 * np.diag(RAD_M**2) + 2 * S @ Q @ S.T, atol=1e-15)
    assert "the laser's mount" in apart.mostly


def test_an_older_result_is_compared_by_its_total_covariance() -> None:
    content = result(sound_speed=axis(3, 2.0), laser_range=axis(3, 5.0))
    older = {name: value for name, value in content.items() if name not in ("systematic", "limits")}
    for pair in ((older, older), (older, content), (content, older)):
        assert variances(*pair)[3] == pytest.approx(2 * (1 + 4 + 25))
        assert movement_between(*map(read, pair)).cautious
    assert not movement_between(read(content), read(content)).cautious


def test_three_answers() -> None:
    """Moved; nothing shown; and too uncertain where more than the limit could stay unseen."""
    sharp, vague = result(), result(sound_speed_gradient=axis(1, 4.0))
    moved = deepcopy(sharp)
    moved["methods"]["adjustment"]["lever_arm_m"][2] += 20 * RAD_M[5]
    assert movement_between(read(sharp), read(moved)).answer == "moved"
    assert movement_between(read(sharp), read(moved)).moved == [5]
    assert movement_between(read(sharp), read(sharp)).answer == "no_movement_shown"
    uncertain = movement_between(read(vague), read(vague))
    assert (uncertain.answer, uncertain.uncertain) == ("too_uncertain", [1])
    assert uncertain.mostly[1] == "change of the sound speed with depth"


@pytest.mark.parametrize(("factor", "answer"), [(1.01, "no_movement_shown"), (0.99, "too_uncertain")])
def test_on_both_sides_of_a_tolerance(factor: float, answer: str) -> None:
    """A tolerance replaces the limit that follows from the verdict's, of its own kind alone."""
    session = read(result())
    found = movement_between(session, session)
    tolerances = np.full(N_MOUNT, np.nan)
    tolerances[:3] = found.detectable.surely[:3].max() * factor
    assert movement_between(session, session, tolerances).answer == answer
    np.testing.assert_array_equal(movement_between(session, session, tolerances).limits[3:], found.limits[3:])


def test_every_parameter_of_the_adjustment_is_declared() -> None:
    """None falls to the row for unknown ones, and no row is hidden behind an earlier one."""
    surfaces = [ObservedSurface.at("P1", np.array([-1.0, 0, 0]), np.zeros(3))]
    state = State.at(np.eye(3), np.zeros(3), surfaces)
    names = [*state.names[N_MOUNT : state.surface_slice.start], *state.names[state.surface_slice.stop :]]
    names += ["face_P1-3", "surfaces_rotation_x"]
    assert all(source_of(name) in ERROR_SOURCES for name in names)
    assert {source_of(name) for name in [*names, *state.names[:N_MOUNT]]} == set(ERROR_SOURCES)
    assert {source_of(name).owner for name in names} == set(OWNERS)
    own = {name for name in names if source_of(name).owner == "session"}
    assert own >= {"mbes_latency", "sound_speed", "sound_speed_gradient", "steering_speed", "laser_latency"}
    assert not own & {"mbes_range", "projector_x", "laser_range", "laser_rotation_x", "wet_P1_shift"}


def test_what_must_be_the_same() -> None:
    """The laser's mount with its sigmas; the target's shape, place and survey; not the day's water level."""
    laser = Laser.model_validate({"files": ["l"], "format": "las", "mount": MOUNT})
    mbes = Mbes.model_validate({"files": ["s"], "format": "gsf", "mount": MOUNT})
    target, survey = Letters.model_validate(LETTERS), AsBuilt()
    stated = stated_of(laser, mbes, target, survey)
    assert set(stated) == set(OWNERS)
    origin = target.origin.model_copy(update={"height_m": 12.1})
    mount = laser.mount.model_copy(update={"z_m": 0.001})
    for owner, other in (
        ("laser_mount", (laser.model_copy(update={"mount": mount}), mbes, target, survey)),
        ("laser", (laser.model_copy(update={"range_bias_sigma_m": 0.003}), mbes, target, survey)),
        ("sonar", (laser, mbes.model_copy(update={"range_bias_sigma_m": 0.003}), target, survey)),
        ("sonar", (laser, mbes.model_copy(update={"projector_offset_m": (0.0, 0.0, 0.1)}), target, survey)),
        ("target", (laser, mbes, target.model_copy(update={"a": 7.0}), survey)),
        ("target", (laser, mbes, target.model_copy(update={"origin": origin}), survey)),
        ("target", (laser, mbes, target, AsBuilt(faces={"P2": 0.001}))),
        (None, (laser, mbes, target.model_copy(update={"water_level_m": 0.3, "azimuth_deg": 5.0}), survey)),
        (None, (laser.model_copy(update={"latency_s": 0.1}), mbes, target, survey)),
    ):
        changed = stated_of(*other)
        assert [name for name in OWNERS if changed[name] != stated[name]] == ([owner] if owner else [])


NO_SHAPE = {"laser": {"effects": {"laser_range": [1.0]}, "stated": "x", "correlation": None}}


@pytest.mark.parametrize("change", [{"session": 3}, NO_SHAPE, None])
def test_a_crafted_block_is_refused(change: Any) -> None:
    content = result()
    content["systematic"] = 3 if change is None else content["systematic"] | change
    with pytest.raises((KeyError, TypeError, ValueError)):
        session_estimate(content)


def test_a_number_that_is_none_is_refused() -> None:
    content = result(sound_speed=axis(1, 2.0))
    content["systematic"]["session"]["effects"]["sound_speed"][1] = float("inf")
    with pytest.raises(ValueError, match="finite"):
        session_estimate(content)
