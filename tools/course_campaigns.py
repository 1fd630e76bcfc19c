"""Campaigns of sessions that pass the target otherwise than toward +y with the wall to starboard, and their page.

python -m tools.montecarlo --only "to port" "both ways" "round a circle"
python -m tools.course_campaigns > docs/accuracy/courses.md
"""

from typing import Any

import pandas as pd

from tools.campaign_statistics import HEAD, markdown_row, statistics_of
from tools.campaigns import DRIFT, Campaign, path_of
from tools.drawn_errors import all_errors
from tools.places import BOTH_SIDES, MOUNT
from tools.session_rows import NAMES

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
PAGE = """# Courses past the target

Made by `python -m tools.course_campaigns` from the rows of `python -m tools.montecarlo --only "to port" "both ways"
"round a circle"`. The target is the demo's. *To port*: a head and a scanner that look to port, on passes that lead
back. *Both ways*: a head that looks down, passes there and back. *Round a circle*: the same head; the boat turns once
in a circle of 1.5 m radius in each pass. The INS drifts; all errors of sensors and target are drawn by their sigmas.
NSE: normalised squared error of the six mount parameters by their total covariance, 6 on average if it is true; in
brackets the band of its mean with 99 % probability; σ is the total sigma.

"""


def page() -> str:
    """Return the page in Markdown, from the rows on disk."""
    lines, others = [HEAD, "|---" + "|---:" * (HEAD.count("|") - 2) + "|"], []
    for campaign in COURSES:
        table = pd.read_parquet(path_of(campaign))
        totals = {f"sigma_{name}": table[f"total_{name}"] for name in NAMES}
        honest = table["accepted"] | table["reasons"].str.startswith("total sigma")
        judged = table.assign(**totals, nse=table["nse_total"])
        lines.append(markdown_row(campaign.name, statistics_of(judged[honest])))
        wrong = judged.loc[~honest, "nse"].sort_values()
        if len(wrong):
            others.append(f"* {campaign.name}: {len(wrong)}, their NSE {', '.join(f'{nse:.0f}' for nse in wrong)}")
    lines += ["", "Not in the table, because rejected for another reason than their sigmas:", "", *others]
    return PAGE + "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(page(), end="")
