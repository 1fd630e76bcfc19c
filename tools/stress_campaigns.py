"""Campaigns whose noise differs from what session.yaml says, to test whether the sigmas stay true.

Each stands for something that real sessions have: faces at 45° along track are noisier than the wall, the INS's errors
change faster than its maker says, a beam's steering errs with its neighbours', and an INS is better than its figures.
"""

from typing import Any

from tools.campaigns import CAMPAIGNS, DRIFT, Campaign
from tools.course_campaigns import COURSES


def _drifting(figures: dict[str, float]) -> dict[str, Any]:
    """Return an INS that drifts by these figures, while session.yaml has those of the usual campaigns."""
    return {"ins": {"drift": figures, "drift_declared": DRIFT["drift"]}}


WITHIN_10_S = {
    "horizontal_m": 0.01, "vertical_m": 0.015, "roll_pitch_deg": 0.005, "heading_deg": 0.01, "time_constant_s": 10.0,
}  # fmt: skip
WITHIN_30_S: dict[str, float] = DRIFT["drift"] | {"time_constant_s": 30.0}
PERFECT_INS: dict[str, Any] = {
    "declare_sigmas": False,  # session.yaml concedes the drift of its defaults
    "ins": {"white": {"position_m": 0.0, "attitude_deg": 0.0}},
    "track": {"distances_m": [4.5, 7.5, 4.5, 7.5], "speed_m_s": 0.25, "half_length_m": 4.0, "ins_height_m": 1.0},
    "motion": {
        "surge": {"amplitude": 0.0, "period_s": 8.0},
        "sway": {"amplitude": 0.15, "period_s": 17.3},
        "heave": {"amplitude": 0.02, "period_s": 3.1},
        "roll": {"amplitude": 1.0, "period_s": 4.1},
        "pitch": {"amplitude": 0.8, "period_s": 5.3},
        "heading": {"amplitude": 1.5, "period_s": 23.0},
    },
    "laser": {"point_rate_hz": 30000.0, "line_rate_hz": 40.0},
    "mbes": {
        "mount": {"roll_deg": -48.0, "pitch_deg": 0.6, "yaw_deg": -0.9, "x_m": 0.35, "y_m": 0.12, "z_m": -1.95},
        "sector_deg": 120.0,
        "outlier_share": 0.005,
        "surface_share": 0.0,
    },
}

STRESS = (
    Campaign("slant noise", 100, 14000, {"ins": DRIFT, "mbes": {"slanted_noise": 3.0}}),
    Campaign("drift within 10 s", 100, 14200, _drifting(WITHIN_10_S)),
    Campaign("drift within 30 s", 100, 14400, _drifting(WITHIN_30_S)),
    Campaign("steering noise", 100, 14600, {"ins": DRIFT, "mbes": {"steering_sigma_deg": 0.06}}),  # 0.8 alike
    Campaign("perfect INS", 100, 14800, PERFECT_INS),
)
ALL = (*CAMPAIGNS, *STRESS, *COURSES)


def named(*beginnings: str) -> tuple[Campaign, ...]:
    """Return the campaigns whose names begin so."""
    return tuple(campaign for campaign in ALL if campaign.name.startswith(beginnings))


def campaign_of(seed: int) -> tuple[Campaign, int]:
    """Return the campaign of a seed, and the session's number in it.

    Raises
    ------
    LookupError
        No campaign has this seed.
    """
    for campaign in ALL:
        if 0 <= seed - campaign.first_seed < campaign.sessions:
            return campaign, seed - campaign.first_seed
    raise LookupError(f"seed {seed}: no campaign has it")
