"""The pages of the campaigns of places, in Markdown, from the rows of their sessions (``tools.place_campaign``)."""

import numpy as np
import pandas as pd

from pipeline.report.reason_codes import WEAK_ALONE
from tools.campaign_statistics import HEAD as STATISTICS_HEAD
from tools.campaign_statistics import markdown_row, nse_band, statistics_of
from tools.session_rows import NAMES

SEEDS_OF_A_PLACE = 1000  # the first of each place is a multiple of it
HEAD = """# Places that nobody has drawn

Made by `python -m tools.place_campaign{first}`, {sessions} sessions of each place. In each session `kind: found`
finds the target in the laser's points. The INS drifts; all errors of the sensors are drawn by their sigmas; below the
water each wall is off by 2 cm and 0.1°, and all are by 1.5 cm of growth (1 sigma), which nobody knows. The limits are
those of `purpose: special_order`: 20 m, 60°. The lock is passed both ways with a head that looks down, the others one
way with a head that looks to starboard.

"""
EXPLAINED = """
The normalised squared error (NSE) by the total covariance is 6 in the mean if the sigmas are true. A session of which a
test or a search says that something is wrong is rejected, and its NSE stands in the last column but one, not in the
first. "Plan" is the total sigma that `poolcal plan` predicts for the passes as they were sailed (distance from the
found wall, place along it, length, speed) and the same unrest, at the faces that the session found, with the mount that
it gave (walls that look one way show yaw by its sine); of the ratios of the first {planned} sessions this is the
median.
"""


def summary(table: pd.DataFrame) -> str:
    """Return the page of the places in Markdown."""
    heads = (
        "place", "accepted", "rejected for sigmas alone", "mean NSE of both (99 % band)", "worst error ÷ σ of accepted",
        f"median total σ: {', '.join(NAMES)} (°, mm)", "σ ÷ plan's", "NSE of those otherwise rejected", "for",
    )  # fmt: skip
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    lines += [_line(str(place), rows) for place, rows in table.groupby("place", sort=False)]
    sessions, planned = (int(table.groupby("place")[name].count().max()) for name in ("seed", "planned_roll"))
    first = int(table["seed"].min()) % SEEDS_OF_A_PLACE
    head = HEAD.format(sessions=sessions, first=f" --first {first}" if first else "")
    return head + "\n".join(lines) + "\n" + EXPLAINED.format(planned=planned)


def _line(place: str, rows: pd.DataFrame) -> str:
    codes = rows["codes"].fillna("no_result")
    accepted = rows["verdict"] == "accepted"
    weak = ~accepted & codes.map(lambda words: set(words.split()) <= WEAK_ALONE)
    honest, others = rows[accepted | weak], rows[~(accepted | weak)]
    errors, totals, found, planned = (
        part[[f"{kind}_{name}" for name in NAMES]].to_numpy(float)
        for kind, part in (("error", rows[accepted]), ("total", honest), ("total", rows), ("planned", rows))
    )
    low, high = nse_band(max(len(honest), 1))
    worst = np.abs(errors / rows.loc[accepted, [f"total_{name}" for name in NAMES]].to_numpy(float))
    medians = np.median(totals, axis=0) if len(honest) else np.full(len(NAMES), np.nan)
    against = np.nanmedian(found / planned, axis=0)
    reasons = ", ".join(sorted({word for words in codes[others.index] for word in words.split()} - WEAK_ALONE))
    cells = (
        place, f"{int(accepted.sum())} of {len(rows)}", str(int(weak.sum())),
        f"{honest['nse_total'].mean():.1f} ({low:.1f} to {high:.1f})", f"{worst.max():.1f}" if len(worst) else "",
        ", ".join(f"{size:.3f}" if k < 3 else f"{size:.1f}" for k, size in enumerate(medians)),
        ", ".join(f"{ratio:.2f}" for ratio in against),
        ", ".join(f"{nse:.0f}" for nse in others["nse_total"]), reasons,
    )  # fmt: skip
    return f"| {' | '.join(cells)} |"


def summary_of_noise(table: pd.DataFrame) -> str:
    """Return the table of sessions without systematic errors in Markdown: whether the random sigmas hold."""
    table = table.assign(accepted=table["verdict"] == "accepted")
    groups = table.groupby("place", sort=False)
    rows = [markdown_row(str(place), statistics_of(of_place)) for place, of_place in groups]
    return "\n".join([STATISTICS_HEAD, "|---" * (STATISTICS_HEAD.count("|") - 1) + "|", *rows]) + "\n"


ROUGH_HEAD = """# Walls as they are

Made by `python -m tools.place_campaign --rough --only {places} --sessions {sessions}`, so many sessions of each
place, as in [places](places.md), and beside it by seed: growth on the wet faces of up to 3 cm that varies by up to
1.5 cm, faces uneven by up to 3 mm, splash; two fenders and a ladder at the largest wall, a footing of 15 to 50 cm along
it in every second session, a moored boat before it in three of ten. In every second session one wet face stands off by
8 to 30 cm, or is turned by 0.6 to 2°, which nobody knows. The limits are those of `purpose: order_1a`. `slip` is a wall
with two returns between two slopes.

"""
ROUGH_EXPLAINED = """
A false face is left out of the adjustment, or the faces are in doubt and the session is rejected; heights with a
footing, a fender's end or splash are left out besides. Where nothing else shows what a face shows, it cannot be tested:
"told" are the sessions with the warning that a wall may be off unnoticed, and what it would do to the mount. The plan
is that of the session's passes at the found faces but for the false one, with the walls' true roughness
(`as_built.roughness_m`), and masks where the footing, the fenders and the ladder stand. Growth of one thickness on all
walls looks like a lever arm: no test shows it, and `as_built.growth_sigma_m` (1.5 cm) has it in the sigmas.
"""


def summary_of_rough(table: pd.DataFrame) -> str:
    """Return the page of the walls as they are in Markdown."""
    heads = (
        "place", "accepted", "of those that the plan allows", "worst error ÷ σ of accepted", "largest NSE of accepted",
        "rejected for sigmas alone", "mean NSE of both", "otherwise rejected", "for", "false faces left out, in doubt",
        "told of the rest", "other faces left out",
    )  # fmt: skip
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    groups = [(str(place), rows.reset_index(drop=True)) for place, rows in table.groupby("place", sort=False)]
    lines += [_line_of_rough(place, rows) for place, rows in groups]
    sessions = int(table.groupby("place").size().max())
    head = ROUGH_HEAD.format(sessions=sessions, places=" ".join(place for place, _ in groups))
    return head + "\n".join(lines) + "\n" + ROUGH_EXPLAINED


def _line_of_rough(place: str, rows: pd.DataFrame) -> str:
    codes, accepted = rows["codes"].fillna("no_result"), rows["verdict"] == "accepted"
    weak = ~accepted & codes.map(lambda words: set(words.split()) <= WEAK_ALONE)
    others = rows[~(accepted | weak)]
    errors, totals = (
        rows.loc[accepted, [f"{kind}_{name}" for name in NAMES]].to_numpy(float) for kind in ("error", "total")
    )
    worst = np.abs(errors / totals).max(initial=0.0)
    reasons = ", ".join(sorted({word for words in codes[others.index] for word in words.split()} - WEAK_ALONE))
    left_out = [set(str(names).split()) for names in rows["left_out"].fillna("")]
    false = [fault for fault in rows["fault"] if fault]
    pairs = list(zip(rows["fault"], left_out, strict=True))
    found = sum(fault in names for fault, names in pairs if fault)
    doubted = codes.map(lambda words: "faces_in_doubt" in words.split())
    each = zip(doubted, pairs, strict=True)
    doubts = sum(doubt and bool(fault) and fault not in names for doubt, (fault, names) in each)
    unseen = np.array([bool(fault) and fault not in names for fault, names in pairs]) & ~doubted.to_numpy(bool)
    unseen &= rows["faces"].notna().to_numpy(bool)
    told = int(rows["told"].fillna(value=False).astype(bool)[unseen].sum())
    allowed = rows["allowed"].fillna(value=False).astype(bool)
    more = sum(len({name for name in names if not name.startswith("?")} - {fault}) for fault, names in pairs)
    cells = (
        place, f"{int(accepted.sum())} of {len(rows)}", f"{int((accepted & allowed).sum())} of {int(allowed.sum())}",
        f"{worst:.1f}" if accepted.any() else "",
        f"{rows.loc[accepted, 'nse_total'].max():.0f}" if accepted.any() else "", str(int(weak.sum())),
        f"{rows.loc[accepted | weak, 'nse_total'].mean():.1f}", str(len(others)), reasons,
        f"{found}, {doubts} of {len(false)}", f"{told} of {int(unseen.sum())}", str(more),
    )  # fmt: skip
    return f"| {' | '.join(cells)} |"
