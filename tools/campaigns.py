"""Campaigns of simulated sessions: which sessions are simulated, with which seeds, and where their rows go."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline.maths.mount_parameters import SETTINGS
from tools.drawn_errors import all_errors, errors_of_pairs

FOLDER = Path("runs/montecarlo")
TASKS_OF_A_WORKER = 20  # then a new process: hundreds of ray casting scenes make a process slow and large
COARSE_DEG, COARSE_M = 2.5, 0.25
THIN: dict[str, Any] = {"laser": {"point_rate_hz": 5000.0}}  # enough laser points for the sonar's noise to dominate
WHITE: dict[str, Any] = {
    "ins": {"white": {"position_m": 0.0, "attitude_deg": 0.0}},
    "laser": {"outlier_share": 0.0, "water_return_share": 0.0},
    "mbes": {"point_beams": True, "corner_share": 0.0, "outlier_share": 0.0, "surface_share": 0.0},
}
DRIFT: dict[str, Any] = {
    "drift": {
        "horizontal_m": 0.015,
        "vertical_m": 0.02,
        "roll_pitch_deg": 0.01,
        "heading_deg": 0.03,
        "time_constant_s": 200.0,
    }
}
HALF: dict[str, Any] = {  # half the pings, and passes just long enough
    "mbes": WHITE["mbes"] | {"ping_rate_hz": 10.0},
    "track": {"half_length_m": 3.6},
}


def _sectors(border_deg: float) -> dict[str, Any]:
    """Return transmit sectors 0.254° apart, as a Kongsberg EM2042 has, symmetrical about the array's normal."""
    edges = ((-border_deg, -0.447), (border_deg, -0.701), (90.0, -0.447))
    return {"mbes": TABLE | {"sectors": [{"to_deg": to, "tilt_deg": tilt} for to, tilt in edges]}}


TABLE: dict[str, Any] = {"format": "parquet", "ping_rate_hz": 10.0}
TWELVE: dict[str, Any] = {"distances_m": [3.5, 6.0, 8.5] * 4, "speed_m_s": 0.18, "gap_s": 20.0}  # 50 s each


@dataclass(frozen=True)
class Campaign:
    """Sessions of one kind, whose seeds are consecutive."""

    name: str
    sessions: int
    first_seed: int
    scenario: dict[str, Any] = field(default_factory=dict)
    through_files: bool = False
    pairs: bool = False  # also compare sessions in pairs: how often does the comparison report a move?
    drawn: Callable[[int], dict[str, Any]] | None = None  # blocks of a session's systematic errors, by its seed

    @property
    def judged_by(self) -> tuple[str, str]:
        """Names of the sigmas and of the squared errors that judge a row: total ones if systematic errors are drawn."""
        return ("total", "nse_total") if self.drawn else ("sigma", "nse")


def _target(**letters: Any) -> dict[str, Any]:
    origin = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}
    return {"a": 8.0, "b": 3.0, "c": 1.0, "e": 0.5, "azimuth_deg": 0.0, "origin": origin} | letters


CAMPAIGNS = (
    Campaign("white noise", 200, 1000, WHITE),
    Campaign("white noise, files and CLI", 10, 1900, WHITE, through_files=True),
    Campaign("azimuth 47, low side north", 64, 2000, WHITE | {"target": _target(azimuth_deg=47.0, low_side="north")}),
    Campaign("azimuth -163", 64, 3000, WHITE | {"target": _target(azimuth_deg=-163.0)}),
    Campaign("target 6/2.4/0.8/0.4", 64, 4000, WHITE | {"target": _target(a=6.0, b=2.4, c=0.8, e=0.4)}),
    Campaign(
        "the same, six passes",
        64,
        4500,
        WHITE
        | {
            "target": _target(a=6.0, b=2.4, c=0.8, e=0.4),
            "track": {"distances_m": [4.0, 8.0, 5.0, 7.0, 4.5, 6.0]},
        },
    ),
    Campaign(
        "origin off by 0.3 m, azimuth by 1",
        64,
        5000,
        WHITE | {"surroundings": {"origin_error_m": [0.3, -0.3, 0.15], "azimuth_error_deg": 1.0}},
    ),
    Campaign("finite beams, outliers, echoes", 600, 6000, {"ins": WHITE["ins"]}),
    Campaign("finite beams and INS white noise", 600, 7000, {}),
    Campaign("finite beams and INS drift", 600, 8000, {"ins": DRIFT}),
    Campaign("twelve passes, INS drift", 320, 9000, {"ins": DRIFT, "track": TWELVE}),
    Campaign("tilted sectors, border at 15", 24, 12000, _sectors(15.0)),
    Campaign("tilted sectors, border at 30", 24, 12100, _sectors(30.0)),
    Campaign("tilted sectors, border at 40", 24, 12200, _sectors(40.0)),
    Campaign("tilted sectors, border at 48", 24, 12300, _sectors(48.0)),
    Campaign("tilted from ping to ping", 24, 12400, {"mbes": TABLE | {"ping_tilts_deg": [0.0, 0.3]}}),
    Campaign("1000 pairs, half as dense", 2000, 10000, WHITE | HALF, pairs=True),
    Campaign("300 pairs, own errors", 600, 13000, WHITE | HALF | {"ins": DRIFT}, pairs=True, drawn=errors_of_pairs),
    Campaign("all errors drawn", 200, 13600, {"ins": DRIFT, "mbes": {"ping_rate_hz": 10.0}}, drawn=all_errors),
)


def path_of(campaign: Campaign) -> Path:
    """Return the file of a campaign's rows."""
    return FOLDER / f"{campaign.name.replace(' ', '_').replace('/', '-').replace(',', '')}.parquet"


def scenario_of(campaign: Campaign, number: int) -> dict[str, Any]:
    """Return the scenario of a session: the campaign's, thinned where it says nothing, coarse and systematic errors."""
    coarse = {"coarse_error": coarse_error(number, COARSE_DEG, COARSE_M)}
    merged: dict[str, Any] = {"name": campaign.name}
    drawn = campaign.drawn(campaign.first_seed + number) if campaign.drawn else {}
    for part in (THIN, campaign.scenario, {"mbes": coarse}, drawn):
        for key, value in part.items():
            merged[key] = merged.get(key, {}) | value if isinstance(value, dict) else value
    return merged


def coarse_error(number: int, size_deg: float, size_m: float) -> dict[str, float]:
    """Return the errors of a coarse mount: of one size on every axis, their signs by the bits of a session's number."""
    signs = [1.0 if number >> bit & 1 else -1.0 for bit in range(6)]
    sizes = (size_deg,) * 3 + (size_m,) * 3
    return {key: sign * size for key, sign, size in zip(SETTINGS, signs, sizes, strict=True)}
