"""Systematic errors of simulated sessions, drawn by the sigmas that hold where session.yaml and the config say nothing.

With all of them drawn, the errors of the mount must be as large as the total sigmas say: this tests every sigma that is
*considered*, with its design and its propagation, and every value that is estimated with its prior, at once.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from pipeline.config.mount import MountSigma
from pipeline.config.pool import AsBuilt
from pipeline.config.session import Laser, Mbes
from pipeline.config.yaml_models import parse
from pipeline.maths.mount_parameters import SETTINGS
from pipeline.maths.target.face import Face
from pipeline.maths.target.model import Family, TargetModel
from pipeline.simulation.scenario import Scenario
from pipeline.target.design import target_of

SOUND_SPEED_M_S = 1500.0  # recorded
Draws = np.random.Generator
DEFAULTS = AsBuilt()


def errors_of_pairs(seed: int) -> dict[str, Any]:
    """Return the blocks of a scenario of pairs, an even seed and the next.

    Each session has its own errors of the sound speed (recorded as 1500 m/s), of the same at the arrays, of its
    gradient, of both clocks, and of ranges by incidence and on level faces. The two sessions of a pair share those of
    the laser's mount, of the sonar's ranges and of the transmitter's place.
    """
    return _of_sensors(np.random.default_rng([seed, 1]), np.random.default_rng([seed // 2, 2]))


def all_errors(seed: int) -> dict[str, Any]:
    """Return the blocks of a scenario on the usual target: the errors of pairs, of all laser ranges, and of faces."""
    return errors_at(target_of(parse(Scenario, {"name": "target"}, "target").target), seed)


def errors_at(model: TargetModel, seed: int, sigmas: AsBuilt = DEFAULTS) -> dict[str, Any]:
    """Return the same at any target, whose faces are off by other sigmas."""
    draws = np.random.default_rng([seed, 3])
    blocks = _of_sensors(draws, draws)
    blocks["laser"]["range_bias_m"] = _drawn(draws, Laser, "range_bias_sigma_m")
    return blocks | {"surroundings": {"face_faults": list(face_faults(model, draws, sigmas))}}


def _drawn(draws: Draws, sensor: type[Laser | Mbes], name: str) -> float:
    return float(sensor.model_fields[name].default * draws.normal())


def _of_sensors(own: Draws, common: Draws) -> dict[str, dict[str, Any]]:
    mount = MountSigma()
    of_mount = np.repeat([mount.angle_deg, mount.lever_arm_m], 3) * common.normal(size=len(SETTINGS))
    return {
        "mbes": {
            "sound_speed_true_m_s": SOUND_SPEED_M_S + _drawn(own, Mbes, "sound_speed_sigma_m_s"),
            "head_speed_excess": _drawn(own, Mbes, "sound_speed_sigma_m_s") / SOUND_SPEED_M_S,
            "sound_speed_gradient_1_s": _drawn(own, Mbes, "sound_speed_gradient_sigma_1_s"),
            "latency_s": _drawn(own, Mbes, "latency_sigma_s"),
            "incidence_bias_m": _drawn(own, Mbes, "incidence_bias_sigma_m"),
            "level_bias_m": _drawn(own, Mbes, "level_bias_sigma_m"),
            "range_bias_m": _drawn(common, Mbes, "range_bias_sigma_m"),
            "projector_offset_m": [_drawn(common, Mbes, "projector_sigma_m") for _ in range(3)],
        },
        "laser": {
            "latency_s": _drawn(own, Laser, "latency_sigma_s"),
            "incidence_bias_m": _drawn(own, Laser, "incidence_bias_sigma_m"),
            "incidence_law": "secant",  # that of the sigma
            "coarse_error": dict(zip(SETTINGS, of_mount.tolist(), strict=True)),
        },
    }


def face_faults(target: TargetModel, draws: Draws, sigmas: AsBuilt = DEFAULTS) -> Iterator[dict[str, Any]]:
    """Yield faults of all faces: each stands out by its own error, and the wet ones of a family differ together.

    The wet faces of a family shift, turn about one point as a rigid body, and bow. Growth is on all of them.
    """
    for face in target.faces:
        yield {"faces": [face.name], "shift_m": sigmas.face_sigma_m * draws.normal()}
    for family in target.families:
        shift_m, turn_deg = sigmas.offset_sigma_m * draws.normal(), sigmas.angle_sigma_deg * draws.normal(size=2)
        bow_m = sigmas.bow_sigma_m * draws.normal()
        wet = [target.faces[number] for number in family.faces if _middle_m(target, target.faces[number]) is not None]
        yield from _rigid(target, family, wet, shift_m, turn_deg)
        if wet and not family.level:
            yield {"faces": [face.name for face in wet], "part": "wet", "bow_m": bow_m}
    if sigmas.growth_sigma_m:
        overgrown = [face.name for face in target.faces if _middle_m(target, face) is not None]
        yield {"faces": overgrown, "part": "wet", "shift_m": sigmas.growth_sigma_m * draws.normal()}


def _rigid(
    target: TargetModel, family: Family, wet: list[Face], shift_m: float, turn_deg: np.ndarray
) -> Iterator[dict[str, Any]]:
    """Yield the faults that shift and turn the wet faces of a family together.

    A turn ω about the faces' common middle c is one about the middle m of a face and a shift by n · (ω × (m - c)).
    """
    middles = np.array([_middle_m(target, face) for face in wet])
    for face, middle in zip(wet, middles, strict=True):
        first = np.array([1.0, 0.0, 0.0] if face.level else [0.0, 0.0, 1.0])
        second = np.array([0.0, 1.0, 0.0]) if face.level else np.cross([0.0, 0.0, 1.0], family.normal)
        turn = np.radians(turn_deg)
        moved_m = shift_m + family.normal @ np.cross(turn[0] * first + turn[1] * second, middle - middles.mean(axis=0))
        about = turn_deg * (1.0 if face.level else [1.0, face.sense])  # the simulator's second axis is e × its normal
        yield {
            "faces": [face.name], "part": "wet", "shift_m": float(face.sense * moved_m), "turn_deg": about.tolist()
        }  # fmt: skip


def _middle_m(target: TargetModel, face: Face) -> np.ndarray | None:
    """Return the middle (3,) of a face's wet part, as the simulator takes it; None if the face is dry."""
    low, high = face.vertices_m[:, 2].min(), min(face.vertices_m[:, 2].max(), target.water_level_m)
    if low >= target.water_level_m:
        return None
    return np.array([*face.vertices_m[:, :2].mean(axis=0), (low + high) / 2])
