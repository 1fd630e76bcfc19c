"""A cast of sound speed: what was made of its file, and whether it is of this session's time, place and water."""

from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import Any

import numpy as np
import pandas as pd

from pipeline.config.references import CastUsed
from pipeline.config.session import Mbes
from pipeline.gps_time import NS, unix_ns_from_gps, utc_text

LONGEST_H = 36.0  # between the cast and the soundings, whatever time zone its file has
FARTHEST_KM = 5.0
ODD_SPEED_M_S = 3.0  # the head's sound speed, so far beyond the cast's, is of other water
RETRACE_DEG = 2.0  # a coarse mount farther off than this wants its rays traced again
EARTH_KM = 6371.0


def in_words(used: CastUsed) -> str:
    """What was made of it, in words."""
    which = f", cast {used.number} of {used.casts}" if used.casts > 1 else ""
    taken = f"taken {used.taken}" if used.taken else "without a time"
    left_out = "".join(f", left out {count} {reason}" for reason, count in used.left_out.items())
    averaged = f"averaged over {used.averaged_m:g} m, " if used.averaged_m else ""
    return (
        f"{used.file}, {used.kind}{which}, {taken}: {used.rows} rows{left_out}; {used.first_m:g} to {used.last_m:g} m, "
        f"{averaged}thinned within {used.tolerance_m_s:g} m/s"
    )


def doubts(
    used: CastUsed | None, span_ns: tuple[int, int] | None, place_deg: tuple[float, float] | None
) -> Iterator[str]:
    """``span_ns``: first and last sounding, GPS time; ``place_deg``: latitude, longitude of the session; None: not
    known."""
    if used is None:
        return
    if used.taken is not None and span_ns is not None:
        cast_s = (datetime.fromisoformat(used.taken) - datetime(1970, 1, 1)).total_seconds()
        first_s, last_s = (float(one) / NS for one in unix_ns_from_gps(np.array(span_ns)))
        apart_h = max(first_s - cast_s, cast_s - last_s) / 3600
        if apart_h > LONGEST_H:
            yield (
                f"mbes.svp: {used.file} was taken at {used.taken}, {apart_h / 24:.1f} days away from the soundings "
                f"({utc_text(span_ns[0])}): the cast is taken for true; take one at the session"
            )
    if used.place_deg is not None and place_deg is not None:
        away_km = _apart_km(used.place_deg, place_deg)
        if away_km > FARTHEST_KM:
            yield (
                f"mbes.svp: {used.file} was taken {away_km:.0f} km from here: the cast is taken for true; take one in "
                "the water of the session"
            )


def cast_doubts(mbes: Mbes, files: pd.DataFrame, correction: Mapping[str, Any]) -> list[str]:
    """A cast that cannot be of this water by what the head recorded; and rays traced through it with a coarse mount far
    off: a ray at θ from straight down bends by g t sin θ, of which a share of δ / tan θ is wrong where θ is wrong by δ
    (a sixtieth for a degree at 45°)."""
    if mbes.svp is None:
        return []
    found = [] if mbes.svp_from is None else list(doubts(mbes.svp_from, _span(files), None))
    speeds = [speed for _, speed in mbes.svp]
    low, high = files["sound_speed_low_m_s"].min(), files["sound_speed_high_m_s"].max()
    if max(low - max(speeds), min(speeds) - high) > ODD_SPEED_M_S:
        found.append(
            f"mbes.svp lies between {min(speeds):.1f} and {max(speeds):.1f} m/s, the head recorded {low:.1f} to "
            f"{high:.1f}: the cast is taken for true; was it taken here and now?"
        )
    turn = correction["rotation_vector_deg"]
    if turn is not None and np.linalg.norm(turn) > RETRACE_DEG:
        found.append(
            f"rays were traced through mbes.svp with a coarse mount that is {np.linalg.norm(turn):.1f}° off: enter the "
            "values found as mbes.mount and run again"
        )
    return found


def _span(files: pd.DataFrame) -> tuple[int, int]:
    """First and last sounding, GPS time."""
    own = files[(files["sensor"] == "mbes") & (files["first_ns"] >= 0)]
    return int(own["first_ns"].min()), int(own["last_ns"].max())


def _apart_km(one_deg: tuple[float, float], other_deg: tuple[float, float]) -> float:
    """Great circle between two places (latitude, longitude) on a sphere, by haversines.

    >>> round(_apart_km((0.0, 179.5), (0.0, -179.5)), 1), round(_apart_km((90.0, 0.0), (0.0, 77.0))), EARTH_KM
    (111.2, 10008, 6371.0)
    """
    (lat, lon), (lat_other, lon_other) = np.radians(one_deg), np.radians(other_deg)
    across = np.cos(lat) * np.cos(lat_other) * np.sin((lon_other - lon) / 2) ** 2
    return float(2 * EARTH_KM * np.arcsin(np.sqrt(np.sin((lat_other - lat) / 2) ** 2 + across)))
