"""Kinds of simulated sessions on which two trees of the source are compared."""

from dataclasses import dataclass, field
from typing import Any

SMALL: dict[str, Any] = {  # two passes, thinned: a run takes about two seconds
    "track": {"distances_m": [4.0, 7.0], "half_length_m": 3.6},
    "laser": {"point_rate_hz": 2000.0, "line_rate_hz": 20.0, "format": "las"},
    "mbes": {"ping_rate_hz": 8.0},
    "ins": {"rate_hz": 50.0},
}
DRIFT = {"horizontal_m": 0.015, "vertical_m": 0.02, "roll_pitch_deg": 0.01, "heading_deg": 0.03, "time_constant_s": 200}
SURVEYED = {
    "face_sigma_deg": 0.001, "plumb_sigma_deg": 0.001, "face_sigma_m": 0.0002, "origin_sigma_m": 0.001,
    "azimuth_sigma_deg": 0.002,
}  # fmt: skip
CAST = [[0.1, 1500.0], [1.0, 1500.2], [2.5, 1501.0], [4.0, 1501.4]]
PLAN = {
    "passes": [{"distance_m": 4.0, "speed_m_s": 0.4}, {"distance_m": 7.0}],
    "laser": {"point_rate_hz": 2000.0},
    "mbes": {"ping_rate_hz": 8.0},
}


@dataclass(frozen=True)
class Kind:
    """A session to simulate, the changes to its YAML files, and the command that calibrates it."""

    scenario: dict[str, Any]
    base: str | None = None  # a scenario of configs/scenarios
    session: dict[str, dict[str, Any]] = field(default_factory=dict)
    pool: dict[str, dict[str, Any]] = field(default_factory=dict)
    command: str = "run"


KINDS = {
    "default": Kind({"laser": {"point_rate_hz": 5000.0}}),
    "small": Kind(SMALL | {"ins": {"rate_hz": 50.0, "drift": DRIFT}, "target": {"azimuth_deg": 163.0}}, "azimuth_163"),
    "dock": Kind({"laser": {"point_rate_hz": 5000.0}, "mbes": {"ping_rate_hz": 8.0}}, "dock"),
    "laser": Kind(
        SMALL | {"laser": SMALL["laser"] | {"coarse_angle_deg": 0.3, "coarse_lever_m": 0.03}},
        pool={"laser_fit": SURVEYED},
        command="laser",
    ),
    "tables": Kind(
        {
            "laser": SMALL["laser"] | {"frame": "EPSG:4978"},
            "ins": {"format": "sbet", "files": "pass"},
            "mbes": {"format": "parquet", "ping_rate_hz": 8.0},
        },
        "tilted_sectors",
    ),
    "cast": Kind(SMALL, session={"mbes": {"svp": CAST}}, pool={"adjust": {"free": ["mbes_latency", "sound_speed"]}}),
    "messy": Kind({"laser": {"point_rate_hz": 5000.0}}, "messy"),
}
