"""Checks of a cast of sound speed: the use of its file, and whether its time, place and speeds fit the session."""

from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import Any

import numpy as np
import pandas as pd

from pipeline.config.references import CastUsed
from pipeline.config.session import Mbes
from pipeline.gps_time import NS, unix_ns_from_gps, utc_text
from pipeline.report.reason_codes import ReasonCode, Statement

MAX_APART_H = 36.0  # between the cast and the soundings; more than any error of the time zone
MAX_APART_KM = 5.0  # between the cast and the session
MAX_SPEED_GAP_M_S = 3.0  # between the head's sound speed and those of the cast: more means other water
MAX_MOUNT_ERROR_DEG = 2.0  # of the coarse mount: with a larger one the rays must be traced again
EARTH_KM = 6371.0


def describe_cast(used: CastUsed) -> str:
    """Return in words the file and the number of the cast, and how its rows were reduced."""
    which = f", cast {used.number} of {used.casts}" if used.casts > 1 else ""
    taken = f"taken {used.taken}" if used.taken else "without a time"
    left_out = "".join(f", left out {count} {reason}" for reason, count in used.left_out.items())
    averaged = f"averaged over {used.averaged_m:g} m, " if used.averaged_m else ""
    return (
        f"{used.file}, {used.kind}{which}, {taken}: {used.rows} rows{left_out}; {used.first_m:g} to {used.last_m:g} m, "
        f"{averaged}thinned within {used.tolerance_m_s:g} m/s"
    )


def cast_origin_warnings(
    used: CastUsed | None, span_ns: tuple[int, int] | None, place_deg: tuple[float, float] | None
) -> Iterator[Statement]:
    """Yield a warning if the cast was taken at another time or place than the session.

    Parameters
    ----------
    used : the cast, with time and place if its file has them; None without a cast
    span_ns : GPS times of the first and the last sounding; None if not known
    place_deg : latitude and longitude of the session; None if not known
    """
    if used is None:
        return
    if used.taken is not None and span_ns is not None:
        cast_s = (datetime.fromisoformat(used.taken) - datetime(1970, 1, 1)).total_seconds()
        first_s, last_s = (float(time) / NS for time in unix_ns_from_gps(np.array(span_ns)))
        apart_h = max(first_s - cast_s, cast_s - last_s) / 3600
        if apart_h > MAX_APART_H:
            yield Statement(
                ReasonCode.CAST_OF_ANOTHER_TIME,
                f"mbes.svp: {used.file} was taken at {used.taken}, {apart_h / 24:.1f} days away from the soundings "
                f"({utc_text(span_ns[0])}): the cast is taken for true; take one at the session",
            )
    if used.place_deg is not None and place_deg is not None:
        apart_km = _apart_km(used.place_deg, place_deg)
        if apart_km > MAX_APART_KM:
            yield Statement(
                ReasonCode.CAST_OF_ANOTHER_PLACE,
                f"mbes.svp: {used.file} was taken {apart_km:.0f} km from here: the cast is taken for true; take one in "
                "the water of the session",
            )


def cast_warnings(mbes: Mbes, files: pd.DataFrame, correction: Mapping[str, Any]) -> Iterator[Statement]:
    """Yield a warning if the cast disagrees with the head's sound speed, or if rays were traced with a wrong mount.

    A ray at the angle θ from the vertical bends by g t sin θ (g: gradient of the sound speed, t: travel time). If the
    coarse mount makes θ wrong by δ, the bend is wrong by its share δ / tan θ (one sixtieth for 1° at 45°).

    Parameters
    ----------
    mbes : settings of the sonar; without a cast there is no warning
    files : the table, with the sound speeds that the head recorded
    correction : the adjustment's block ``correction`` of calibration.json
    """
    if mbes.svp is None:
        return
    if mbes.svp_from is not None:
        yield from cast_origin_warnings(mbes.svp_from, _span_ns(files), None)
    speeds = [speed for _, speed in mbes.svp]
    low, high = files["sound_speed_low_m_s"].min(), files["sound_speed_high_m_s"].max()
    if max(low - max(speeds), min(speeds) - high) > MAX_SPEED_GAP_M_S:
        yield Statement(
            ReasonCode.CAST_OFF_HEAD_SPEED,
            f"mbes.svp lies between {min(speeds):.1f} and {max(speeds):.1f} m/s, the head recorded {low:.1f} to "
            f"{high:.1f}: the cast is taken for true; was it taken here and now?",
        )
    rotation_deg = correction["rotation_vector_deg"]
    if rotation_deg is not None and np.linalg.norm(rotation_deg) > MAX_MOUNT_ERROR_DEG:
        yield Statement(
            ReasonCode.RAYS_TRACED_WITH_WRONG_MOUNT,
            f"rays were traced through mbes.svp with a coarse mount that is {np.linalg.norm(rotation_deg):.1f}° off: "
            "enter the values found as mbes.mount and run again",
        )


def _span_ns(files: pd.DataFrame) -> tuple[int, int]:
    """Return GPS times of the first and the last sounding, from the table ``files``."""
    own = files[(files["sensor"] == "mbes") & (files["first_ns"] >= 0)]
    return int(own["first_ns"].min()), int(own["last_ns"].max())


def _apart_km(first_deg: tuple[float, float], second_deg: tuple[float, float]) -> float:
    """Return the great-circle distance (km) of two places (latitude, longitude; degrees), by haversines.

    >>> round(_apart_km((0.0, 179.5), (0.0, -179.5)), 1), round(_apart_km((90.0, 0.0), (0.0, 77.0))), EARTH_KM
    (111.2, 10008, 6371.0)
    """
    (lat_1, lon_1), (lat_2, lon_2) = np.radians(first_deg), np.radians(second_deg)
    across = np.cos(lat_1) * np.cos(lat_2) * np.sin((lon_2 - lon_1) / 2) ** 2
    return float(2 * EARTH_KM * np.arcsin(np.sqrt(np.sin((lat_2 - lat_1) / 2) ** 2 + across)))
