"""Campaigns of sessions that pass the target otherwise than toward +y with the wall to starboard.

python -m tools.montecarlo --only "to port" "both ways" "round a circle"
"""

from typing import Any

from tools.campaigns import DRIFT, Campaign
from tools.drawn_errors import all_errors
from tools.places import BOTH_SIDES, MOUNT

RATES: dict[str, dict[str, Any]] = {"mbes": {"ping_rate_hz": 10.0}, "laser": {"point_rate_hz": 10_000.0}}
WIDE = {name: BOTH_SIDES[name] | RATES[name] for name in RATES}
PORT: dict[str, Any] = {
    "mbes": {"mount": MOUNT | {"roll_deg": 48.8, "x_m": -0.30}, "ping_rate_hz": 10.0},
    "laser": {"field_deg": [-130.0, -30.0], "point_rate_hz": 5000.0},
    "track": {"courses": ["back"]},
}
CIRCLE: dict[str, Any] = {"courses": ["circle"], "circle_radius_m": 1.5, "distances_m": [4.0, 7.0, 5.0, 6.0]}
COURSES = tuple(
    Campaign(name, 48, first_seed, {"ins": DRIFT, **blocks}, drawn=all_errors)
    for name, first_seed, blocks in (
        ("to port", 16000, PORT),
        ("both ways", 16100, WIDE | {"track": BOTH_SIDES["track"]}),
        ("round a circle", 16200, WIDE | {"track": CIRCLE}),
    )
)
