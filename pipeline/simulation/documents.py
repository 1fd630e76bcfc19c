"""The texts of a session: session.yaml, pool.yaml and the truth beside them."""

from typing import Any

import numpy as np

from pipeline.config.mount import Mount
from pipeline.gps_time import WEEK_NS
from pipeline.simulation.motion import Movement
from pipeline.simulation.mounts import R_body_from_sensor, coarse_error, coarse_mount, lever_arm_m
from pipeline.simulation.scenario import Scenario

INS_SUFFIX = {"inspvas": "gps", "inspva": "gps", "inspvasa": "asc", "inspvaa": "asc", "sbet": "sbet"}
_Text = dict[str, Any]


def session_text(scenario: Scenario, movement: Movement, seed: int) -> _Text:
    """session.yaml. Sigmas are those put in; where one is zero it is left out, so that the default holds."""
    ins, laser, mbes = scenario.ins, scenario.laser, scenario.mbes
    first_ns = movement.ins_runs_ns(0)[0]
    about_ins: _Text = {"files": [f"ins/*.{INS_SUFFIX[ins.format]}"]}
    about_ins["format"] = "sbet" if ins.format == "sbet" else "novatel"
    if ins.format == "sbet":
        about_ins["gps_week"] = first_ns // WEEK_NS
    if scenario.declare_sigmas:
        about_ins |= {"drift": ins.drift.model_dump(), "white": ins.white.model_dump()}
    about_laser: _Text = {"files": [f"laser/*.{laser.format}"], "format": "las"}
    if laser.time == "week_seconds":
        about_laser["gps_week"] = movement.starts_ns[0] // WEEK_NS
    about_laser |= {"frame": laser.frame, "mount": coarse_mount(laser, seed).model_dump()}
    about_laser["latency_s"] = laser.latency_declared_s
    about_mbes: _Text = {
        "files": [f"mbes/*.{mbes.format}"],
        "format": "table" if mbes.format == "parquet" else "r2sonic",
        "mount": coarse_mount(mbes, seed).model_dump(),
        "sound_speed_m_s": mbes.sound_speed_true_m_s if mbes.give_true_sound_speed else None,
    }
    if mbes.give_projector_offset:
        about_mbes["projector_offset_m"] = list(mbes.projector_offset_m)
    about_mbes["latency_s"] = mbes.latency_declared_s
    if scenario.declare_sigmas:
        about_laser |= _sigmas(laser.range_sigma_m, laser.angle_sigma_deg)
        about_mbes |= _sigmas(mbes.range_sigma_m, mbes.angle_sigma_deg) | {"beam_deg": list(mbes.beam_deg)}
    name = f"{scenario.start_utc[:10]}_{scenario.name}"
    return {"name": name, "ins": about_ins, "laser": about_laser, "mbes": about_mbes}


def _sigmas(range_m: float, angle_deg: float) -> _Text:
    given = {"range_sigma_m": range_m, "angle_sigma_deg": angle_deg}
    return {key: value for key, value in given.items() if value > 0}


def pool_text(scenario: Scenario, movement: Movement) -> _Text:
    """pool.yaml: the design, standing where the surveyor believes it to stand."""
    around, target = scenario.surroundings, scenario.target.model_dump(mode="json")
    if any(around.origin_error_m):
        believed = np.array([around.origin_error_m])
        latitude, longitude, height = (float(v[0]) for v in movement.site.geodetic_from_target(believed))
        degrees = {"latitude_deg": float(np.degrees(latitude)), "longitude_deg": float(np.degrees(longitude))}
        target["origin"] = degrees | {"height_m": height}
    target["azimuth_deg"] = scenario.azimuth_deg + around.azimuth_error_deg if around.give_azimuth else None
    return {"target": target}


def truth_text(scenario: Scenario, movement: Movement, seed: int) -> _Text:
    """What a calibration should find, and what was done to the data."""
    mbes, mount = scenario.mbes, scenario.mbes.mount
    error: Mount = coarse_error(mbes, seed)
    return {
        "schema": 1,
        "scenario": scenario.name,
        "seed": seed,
        "mbes": {
            "mount": mount.model_dump(),
            "R_body_from_mbes": R_body_from_sensor(mount).as_matrix().tolist(),
            "lever_arm_m": lever_arm_m(mount).tolist(),
        },
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
