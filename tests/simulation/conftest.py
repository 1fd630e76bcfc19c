"""Small scenarios, and a georeferencing of raw columns written out by hand from the conventions alone."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyproj import Transformer

from pipeline.simulation.scenario import Scenario, load_scenario
from pipeline.simulation.session import SimulatedSession
from tests.support.roots import SCENARIOS


@pytest.fixture(scope="session")
def scenarios() -> Path:
    return SCENARIOS


def _changed(scenario: Scenario, **changes: dict[str, Any]) -> Scenario:
    content = scenario.model_dump(mode="json")
    for block, values in changes.items():
        content[block].update(values)
    return Scenario.model_validate_json(json.dumps(content), strict=True)


@pytest.fixture(scope="session")
def changed() -> Callable[..., Scenario]:
    """``changed(scenario, mbes={"latency_s": 0.1})``"""
    return _changed


@pytest.fixture(scope="session")
def noise_free() -> Scenario:
    """Two passes, thinned: a tenth of a second to simulate."""
    return _changed(
        load_scenario(SCENARIOS / "noise_free.yaml"),
        track={"distances_m": [4.0, 8.0]}, laser={"point_rate_hz": 1000.0, "line_rate_hz": 3.0},
        mbes={"ping_rate_hz": 3.0, "beams": 128},
    )


@pytest.fixture(scope="session")
def noisy(noise_free: Scenario) -> Scenario:
    """The default scenario, thinned in the same way."""
    default = Scenario()
    return _changed(
        default, track={"distances_m": [4.0, 8.0]}, laser={"point_rate_hz": 1000.0, "line_rate_hz": 3.0},
        mbes={"ping_rate_hz": 3.0, "beams": 128},
    )


def _rx(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def _ry(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def _rz(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def _ray(across: float, forward: float) -> np.ndarray:
    """The ray of the receive beam across (its sine), turned about the receiving array until it looks so far forward:
    about x, and so stays in its beam."""
    upright = np.array([across, 0.0, -np.cos(np.arcsin(across))])
    return np.asarray(_rx(np.arcsin(forward / -upright[2])) @ upright)


def _place(simulated: SimulatedSession, sensor: str, mount: dict[str, float], every: int = 1) -> np.ndarray:
    """(n, 3) points in the target frame, georeferenced one by one through ECEF."""
    origin, azimuth_deg = simulated.truth["target"]["origin"], simulated.truth["target"]["azimuth_deg"]
    to_ecef = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    at = np.array(to_ecef.transform(origin["longitude_deg"], origin["latitude_deg"], origin["height_m"]))
    R_ecef_from_level = _level(np.radians(origin["latitude_deg"]), np.radians(origin["longitude_deg"]))
    R_target_from_ecef = (R_ecef_from_level @ _rz(-np.radians(azimuth_deg))).T
    roll, pitch, yaw = np.radians([mount["roll_deg"], mount["pitch_deg"], mount["yaw_deg"]])
    R_body_from_sensor = _rz(yaw) @ _rx(pitch) @ _ry(roll)
    lever = np.array([mount["x_m"], mount["y_m"], mount["z_m"]])
    if sensor == "laser":
        data = {name: values[::every] for name, values in simulated.laser.items()}
        points = np.stack([data["x_m"], data["y_m"], data["z_m"]], axis=1)
    else:
        data = {name: values[::every] for name, values in simulated.mbes.items()}
        speed = simulated.truth["sound_speed_true_m_s"]
        ranges, k = data["two_way_time_s"] / 2 * speed, speed / data["sound_speed_m_s"]
        beams = zip(k * np.sin(data["angle_rad"]), k * np.sin(data["transmit_tilt_rad"]), strict=True)
        points = ranges[:, None] * np.array([_ray(*sines) for sines in beams])
    ins, begin = simulated.ins, simulated.ins["t_ns"][0]
    when, epochs = (data["t_ns"] - begin) / 1e9, (ins["t_ns"] - begin) / 1e9
    pose = {name: np.interp(when, epochs, np.unwrap(ins[name])) for name in ins if name != "t_ns"}
    placed = []
    for k, point in enumerate(points):
        latitude, longitude, height = (pose[name][k] for name in ("latitude_rad", "longitude_rad", "height_m"))
        ecef = np.array(to_ecef.transform(np.degrees(longitude), np.degrees(latitude), height))
        R_level_from_body = _rz(-pose["azimuth_rad"][k]) @ _rx(pose["pitch_rad"][k]) @ _ry(pose["roll_rad"][k])
        ecef = ecef + _level(latitude, longitude) @ R_level_from_body @ (R_body_from_sensor @ point + lever)
        placed.append(R_target_from_ecef @ (ecef - at))
    return np.array(placed)


def _level(latitude: float, longitude: float) -> np.ndarray:
    """East, north, up as columns."""
    sp, cp, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    return np.array([[-sl, -sp * cl, cp * cl], [cl, -sp * sl, cp * sl], [0, cp, sp]])


@pytest.fixture(scope="session")
def place() -> Callable[..., np.ndarray]:
    return _place
