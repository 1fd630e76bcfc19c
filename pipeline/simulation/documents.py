"""The documents of a session: session.yaml, pool.yaml and the truth beside them."""

from typing import Any

import numpy as np

from pipeline.config.heads import HEADS
from pipeline.config.mount import Mount
from pipeline.config.pool import AsBuilt
from pipeline.gps_time import WEEK_NS
from pipeline.simulation.motion import Movement
from pipeline.simulation.mounts import R_body_from_sensor, coarse_error, coarse_mount, lever_arm_m
from pipeline.simulation.scenario import Scenario

INS_SUFFIX = {"inspvas": "gps", "inspva": "gps", "inspvasa": "asc", "inspvaa": "asc", "sbet": "sbet"}
_Text = dict[str, Any]


def session_text(scenario: Scenario, movement: Movement, seed: int) -> _Text:
    """Return the content of session.yaml.

    Its sigmas are those of the simulated noise, or left out if the scenario does not declare them. A range or angle
    sigma of zero is left out too, so that the default applies.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    movement : Movement
        The vessel's movement, for the GPS weeks.
    seed : int
        Seed of the coarse mounts' errors.
    """
    ins, laser = scenario.ins, scenario.laser
    first_ns = movement.ins_runs_ns(0)[0]
    ins_block: _Text = {"files": [f"ins/*.{INS_SUFFIX[ins.format]}"]}
    ins_block["format"] = "sbet" if ins.format == "sbet" else "novatel"
    if ins.format == "sbet":
        ins_block["gps_week"] = first_ns // WEEK_NS
    if scenario.declare_sigmas:
        ins_block |= {"drift": (ins.drift_declared or ins.drift).model_dump(), "white": ins.white.model_dump()}
    laser_block: _Text = {"files": [f"laser/*.{laser.format}"], "format": "las"}
    if laser.time == "week_seconds":
        laser_block["gps_week"] = movement.starts_ns[0] // WEEK_NS
    laser_block |= {"frame": laser.frame, "mount": coarse_mount(laser, seed).model_dump()}
    laser_block["latency_s"] = laser.latency_declared_s
    if scenario.declare_sigmas:
        laser_block |= _sigmas(laser.range_sigma_m, laser.angle_sigma_deg)
    heads = [_head_block(scenario, head, seed) for head in scenario.heads]
    name = f"{scenario.start_utc[:10]}_{scenario.name}"
    return {"name": name, "ins": ins_block, "laser": laser_block, "mbes": heads if scenario.further else heads[0]}


def _head_block(scenario: Scenario, head: str, seed: int) -> _Text:
    """Return the block of one head of the sonar, by its name."""
    mbes = scenario.heads[head]
    block: _Text = {
        "files": [f"{head}/*.{mbes.format}"],
        "format": "table" if mbes.format == "parquet" else "r2sonic",
        "mount": coarse_mount(mbes, seed, HEADS.index(head)).model_dump(),
        "sound_speed_m_s": mbes.sound_speed_true_m_s if mbes.give_true_sound_speed else None,
    }
    if mbes.svp_declared:
        block["svp"] = [list(row) for row in mbes.svp_declared]
    if mbes.give_projector_offset:
        block["projector_offset_m"] = list(mbes.projector_offset_m)
    block["latency_s"] = mbes.latency_declared_s
    if scenario.declare_sigmas:
        block |= _sigmas(mbes.range_sigma_m, mbes.angle_sigma_deg) | {"beam_deg": list(mbes.beam_deg)}
        block["focused"] = [aperture == 0 for aperture in mbes.aperture_m]
    return block


def _sigmas(range_m: float, angle_deg: float) -> _Text:
    sigmas = {"range_sigma_m": range_m, "angle_sigma_deg": angle_deg}
    return {key: value for key, value in sigmas.items() if value > 0}


def pool_text(scenario: Scenario, movement: Movement) -> _Text:
    """Return the content of pool.yaml: the target by its design, at its surveyed position (with survey errors).

    It states the sigmas of a target that was surveyed face by face: what differs from the design is planted unknown.
    """
    surroundings, target = scenario.surroundings, scenario.target.model_dump(mode="json")
    if any(surroundings.origin_error_m):
        surveyed = np.array([surroundings.origin_error_m])
        latitude, longitude, height = (float(v[0]) for v in movement.site.geodetic_from_target(surveyed))
        degrees = {"latitude_deg": float(np.degrees(latitude)), "longitude_deg": float(np.degrees(longitude))}
        target["origin"] = degrees | {"height_m": height}
    azimuth_deg = scenario.azimuth_deg + surroundings.azimuth_error_deg
    target["azimuth_deg"] = azimuth_deg if surroundings.give_azimuth else None
    return {"target": target, "as_built": AsBuilt().model_dump(exclude={"faces"})}


def truth_text(scenario: Scenario, movement: Movement, seed: int) -> _Text:
    """Return the truth: true mounts, the error of the sonar's coarse mount, and all settings of the scenario.

    Of several heads of the sonar ``mbes`` is the first; ``heads`` has all.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    movement : Movement
        The vessel's movement, for the times of the passes.
    seed : int
        Seed of the session.
    """
    mbes = scenario.mbes
    error: Mount = coarse_error(mbes, seed)
    heads = [
        {"name": name, **_true_mount(head.mount), "coarse_error": coarse_error(head, seed, number).model_dump()}
        for number, (name, head) in enumerate(scenario.heads.items())
    ]
    return {
        "schema": 1,
        "scenario": scenario.name,
        "seed": seed,
        "mbes": _true_mount(mbes.mount),
        **({"heads": heads} if scenario.further else {}),
        "coarse_error": error.model_dump(),
        "laser": {
            "mount": scenario.laser.mount.model_dump(),
            "R_body_from_laser": R_body_from_sensor(scenario.laser.mount).as_matrix().tolist(),
            "lever_arm_m": lever_arm_m(scenario.laser.mount).tolist(),
        },
        "target": {"origin": scenario.target.origin.model_dump(), "azimuth_deg": scenario.azimuth_deg},
        "sound_speed_true_m_s": mbes.sound_speed_true_m_s,
        "sound_speed_recorded_m_s": mbes.sound_speed_recorded_m_s,
        "latencies": {
            "laser_s": scenario.laser.latency_s, "mbes_s": mbes.latency_s,
            "laser_declared_s": scenario.laser.latency_declared_s, "mbes_declared_s": mbes.latency_declared_s,
        },
        "passes": [
            {"start_ns": start, "end_ns": end, "distance_m": distance}
            for start, end, distance in zip(movement.starts_ns, movement.ends_ns, movement.distances_m, strict=True)
        ],
        "settings": scenario.model_dump(mode="json"),
    }


def _true_mount(mount: Mount) -> _Text:
    """Return the true mount of a head: angles and lever arm, and the rotation as a matrix."""
    return {
        "mount": mount.model_dump(),
        "R_body_from_mbes": R_body_from_sensor(mount).as_matrix().tolist(),
        "lever_arm_m": lever_arm_m(mount).tolist(),
    }
