"""Tables of the boat's track (INS records): the trajectory, the pool frame and the passes."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.points import TRAJECTORY
from pipeline.artefacts.streams import Batch
from pipeline.config.pool import TargetPlace
from pipeline.errors import RawDataError
from pipeline.gps_time import NS
from pipeline.maths.geometry.geodesy import PoolFrame, ecef_from_geodetic
from pipeline.maths.geometry.passes import estimate_azimuth, find_passes, pass_of


def trajectory_table(chunks: Sequence[Batch]) -> tuple[pd.DataFrame, int]:
    """Return the table ``trajectory``, INS records in order of time, and the number left out.

    Of equal times only the first is kept.
    """
    chunks = sorted(chunks, key=lambda columns: int(columns["t_ns"][0]))
    table = pd.DataFrame(
        {c.name: np.concatenate([columns[c.name] for columns in chunks]) for c in TRAJECTORY.columns}
    )
    order = np.argsort(table["t_ns"].to_numpy(), kind="stable")
    table = table.iloc[order]
    kept = np.diff(table["t_ns"].to_numpy(), prepend=np.iinfo(np.int64).min // 2) > 0
    return table[kept].reset_index(drop=True), int((~kept).sum())


def pool_frame_table(trajectory: pd.DataFrame, target: TargetPlace) -> tuple[pd.DataFrame, PoolFrame]:
    """Return the table ``pool_frame`` and the frame; without an azimuth in the settings it is estimated from the track.

    Parameters
    ----------
    trajectory : DataFrame
        INS records in order of time.
    target : TargetPlace
        Origin and azimuth of the target in the settings.

    Raises
    ------
    RawDataError
        The settings have no azimuth, and none can be estimated.
    """
    origin = target.origin
    place = (np.radians(origin.latitude_deg), np.radians(origin.longitude_deg), origin.height_m)
    azimuth = target.azimuth_deg
    if azimuth is None:
        level = PoolFrame.at(*place, 0.0)
        geodetic = (trajectory[name].to_numpy() for name in ("latitude_rad", "longitude_rad", "height_m"))
        points = level.points_from_ecef(ecef_from_geodetic(*geodetic))
        estimate = estimate_azimuth(points[:, 0], points[:, 1], trajectory["azimuth_rad"].to_numpy())
        if estimate is None:
            raise RawDataError(
                "target.azimuth_deg is not given and the boat never had target.origin within 20 m abeam; "
                "give azimuth_deg, or check target.origin"
            )
        azimuth = float(np.degrees(estimate))
    table = pd.DataFrame(
        {
            "latitude_deg": [origin.latitude_deg],
            "longitude_deg": [origin.longitude_deg],
            "height_m": [origin.height_m],
            "azimuth_deg": [azimuth],
            "azimuth_estimated": [target.azimuth_deg is None],
        }
    )
    return table, PoolFrame.at(*place, float(np.radians(azimuth)))


def passes_table(
    trajectory: pd.DataFrame, frame: PoolFrame, epochs_ns: NDArray[np.int64], max_gap_ns: int, reversal_m: float
) -> pd.DataFrame:
    """Return the table ``passes``.

    Parameters
    ----------
    trajectory : DataFrame
        INS records in order of time.
    frame : PoolFrame
        Frame of the positions.
    epochs_ns : (n,) array
        Ascending times of pings (or of laser points, one a second), GPS ns.
    max_gap_ns : int
        Longest interval without a record inside a pass, ns.
    reversal_m : float
        Movement back along the track that ends a pass, m.

    Raises
    ------
    RawDataError
        There is no pass.
    """
    t_ns = trajectory["t_ns"].to_numpy()
    geodetic = (trajectory[name].to_numpy() for name in ("latitude_rad", "longitude_rad", "height_m"))
    points = frame.points_from_ecef(ecef_from_geodetic(*geodetic))
    passes = find_passes(t_ns, points[:, 1], epochs_ns, max_gap_ns, reversal_m)
    if not passes:
        raise RawDataError(
            "session.yaml: ins and mbes never ran together for a second without a gap above "
            f"{max_gap_ns / NS:g} s; check the logs, or raise ingest.max_gap_s"
        )
    starts, ends = (np.array(column, dtype=np.int64) for column in zip(*passes, strict=True))
    number = pass_of(t_ns, starts, ends)
    azimuth = trajectory["azimuth_rad"].to_numpy()
    rows = []
    for k, interval in enumerate(passes):
        inside = number == k
        rows.append({"pass": k} | _pass_row(interval, points[inside], azimuth[inside]))
    return pd.DataFrame(rows)


def _pass_row(
    interval: tuple[int, int], points_pool_m: NDArray[np.float64], azimuth_rad: NDArray[np.float64]
) -> dict[str, float]:
    """Return a pass's row of the table ``passes``, without its number, from its INS records (n, which may be 0)."""
    start, end = interval
    seconds = (end - start) / NS
    length, mean, swing, distance = (np.nan,) * 4
    if len(points_pool_m):
        along, athwart = points_pool_m[:, 1], np.abs(points_pool_m[:, 0])
        abeam = np.abs(along) <= athwart
        length = float(along[-1] - along[0])
        mean = np.arctan2(np.sin(azimuth_rad).mean(), np.cos(azimuth_rad).mean())
        swing = np.sqrt(np.mean(np.angle(np.exp(1j * (azimuth_rad - mean))) ** 2))
        distance = float(np.median(athwart[abeam] if abeam.any() else athwart))
    return {
        "start_ns": start,
        "end_ns": end,
        "duration_s": seconds,
        "length_m": length,
        "speed_m_s": abs(length) / seconds,
        "azimuth_deg": float(np.degrees(mean)),
        "heading_swing_deg": float(np.degrees(swing)),
        "distance_m": distance,
    }
