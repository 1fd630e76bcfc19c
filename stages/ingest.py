"""Raw instrument files -> canonical streams and tables, with quality control."""

from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline import artefacts, config
from pipeline.checking.days import DAY_NS, whole_days
from pipeline.errors import RawDataError
from pipeline.ins_sigmas import thinned
from pipeline.maths.geodesy import PoolFrame, ecef_from_geodetic
from pipeline.passes import estimate_azimuth, find_passes, pass_of, split_at_gaps
from pipeline.rates import rate_hz
from pipeline.screen import plural
from pipeline.streams import EMPTY, Chunk, Piece, Stream
from pipeline.times import NS, WEEK_NS, utc_text

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Config:
    target_place: config.TargetPlace
    ingest: config.Ingest
    recordings: config.Recordings


@dataclass(frozen=True)
class Inputs:
    ins: Annotated[Stream, artefacts.Raw("ins")]
    laser: Annotated[Stream, artefacts.Raw("laser")]
    mbes: Annotated[Stream, artefacts.Raw("mbes")]


@dataclass(frozen=True)
class Outputs:
    trajectory: Annotated[pd.DataFrame, artefacts.TRAJECTORY]
    ins_sigmas: Annotated[pd.DataFrame, artefacts.INS_SIGMAS]
    passes: Annotated[pd.DataFrame, artefacts.PASSES]
    pool_frame: Annotated[pd.DataFrame, artefacts.POOL_FRAME]
    files: Annotated[pd.DataFrame, artefacts.FILES]
    gaps: Annotated[pd.DataFrame, artefacts.GAPS]
    counts: Annotated[pd.DataFrame, artefacts.INGEST_COUNTS]
    laser_points: Annotated[Stream, artefacts.LASER_POINTS] = EMPTY
    soundings: Annotated[Stream, artefacts.SOUNDINGS] = EMPTY


@dataclass(frozen=True)
class Seen:
    """What is kept of one chunk: counts, epochs (INS records or pings; of laser points one a second, and the last)."""

    count: int
    dropped: dict[str, int]
    epochs_ns: NDArray[np.int64]
    trajectory: Columns
    sigmas: Columns = field(default_factory=dict)  # of the INS, thinned
    accuracy: bool = False  # of a file of sigmas alone
    lowest_speed_m_s: float = np.inf  # sound speeds recorded with the pings
    highest_speed_m_s: float = -np.inf


def prepare(inputs: Inputs, config: Config) -> None:
    return None


def run_batch(source: str, chunk: Chunk, prepared: None, config: Config) -> Piece:
    t_ns = np.asarray(chunk.columns["t_ns"], dtype=np.int64) if chunk.columns else np.empty(0, np.int64)
    dropped = dict(chunk.dropped)
    if source == "ins":
        accuracy, sigmas = not chunk.columns, thinned(chunk.sigmas)
        epochs = sigmas.get("t_ns", t_ns) if accuracy else t_ns
        return Piece({}, Seen(len(t_ns), dropped, epochs, dict(chunk.columns), sigmas, accuracy))
    if source == "laser":
        return Piece({"laser_points": chunk.columns}, Seen(len(t_ns), dropped, _seconds(t_ns), {}))
    speed = np.asarray(chunk.columns["sound_speed_m_s"]) if len(t_ns) else np.empty(0)
    lowest, highest = (float(speed.min()), float(speed.max())) if len(speed) else (np.inf, -np.inf)
    seen = Seen(
        len(t_ns), dropped, np.unique(t_ns), {}, lowest_speed_m_s=lowest, highest_speed_m_s=highest
    )
    return Piece({"soundings": chunk.columns}, seen)


def combine(prepared: None, partials: dict[str, list[tuple[str, Seen]]], config: Config) -> Outputs:
    _refuse_empty({sensor: seen for sensor, seen in partials.items() if sensor != "mbes" or config.recordings.mbes})
    trajectory, backwards = _trajectory([seen.trajectory for _, seen in partials["ins"] if seen.count])
    ins_t = trajectory["t_ns"].to_numpy()
    epochs = {
        sensor: np.unique(np.concatenate([seen.epochs_ns for _, seen in partials[sensor]]))
        for sensor in ("laser", "mbes")
        if partials[sensor]
    }
    _refuse_apart((ins_t[0], ins_t[-1]), {sensor: (t_ns[0], t_ns[-1]) for sensor, t_ns in epochs.items()})
    sounded = "mbes" if "mbes" in epochs else "laser"  # by what passes are told
    pool_frame, frame = _pool_frame(trajectory, config.target_place)
    max_gap_ns = round(config.ingest.max_gap_s * NS)
    sigmas, outside = _sigmas(partials["ins"], int(ins_t[0]), int(ins_t[-1]))
    counts = _counts(partials, {"ins": backwards}, outside)
    return Outputs(
        trajectory=trajectory,
        ins_sigmas=sigmas,
        passes=_passes(trajectory, frame, epochs[sounded], max_gap_ns, config.ingest.reversal_m),
        pool_frame=pool_frame,
        files=_files(partials),
        gaps=_gaps({"ins": ins_t, sounded: epochs[sounded]}, max_gap_ns),
        counts=counts,
    )


def _seconds(t_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """The first moment of each second in which there is one, and the last of all."""
    if not len(t_ns):
        return t_ns
    ordered = np.sort(t_ns)
    first = np.flatnonzero(np.diff(ordered // NS, prepend=-1))
    return np.append(ordered[first], ordered[-1])


def _refuse_empty(partials: dict[str, list[tuple[str, Seen]]]) -> None:
    for sensor, seen in partials.items():
        if not sum(piece.count for _, piece in seen):
            names = sorted({name.split("#")[0] for name, _ in seen})
            reasons: dict[str, int] = {}
            for _, piece in seen:
                for reason, number in piece.dropped.items():
                    reasons[reason] = reasons.get(reason, 0) + number
            why = (
                ", ".join(f"{number} x {reason}" for reason, number in sorted(reasons.items())) or "the files are empty"
            )
            advice = {
                "ins": "log again after the INS has aligned, with INSPVA(S) on",
                "laser": "export the scan again, with time stamps",
                "mbes": "check that bathymetry was logged",
            }[sensor]
            raise RawDataError(f"{', '.join(names[:3])}: no usable {sensor} record ({why}); {advice}")


def _meet(ins: tuple[int, int], other: tuple[int, int], offset_ns: int) -> bool:
    return ins[0] <= other[1] - offset_ns and other[0] - offset_ns <= ins[1]


def _refuse_apart(ins: tuple[int, int], spans: dict[str, tuple[int, int]]) -> None:
    for sensor, (first, last) in spans.items():
        start, end = ins
        if last < start or first > end:
            apart = first - start
            days = whole_days(ins, (first, last), partial(_meet, ins, (first, last)))
            weeks = round(apart / WEEK_NS)
            hint = "check the instruments' clocks and latency_s"
            if days:
                amount, ahead, why = days
                hint = f"{sensor} is {amount} {'ahead of' if ahead else 'behind'} the INS: {why}"
            elif weeks and _meet(ins, (first, last), weeks * WEEK_NS):
                hint = f"they are {plural(abs(weeks), 'week')} apart: check gps_week"
            elif abs(apart) > WEEK_NS / 2:
                hint = f"they are {abs(apart) / DAY_NS:.0f} days apart: name files of one session"
            raise RawDataError(
                f"session.yaml: no time overlap: ins {utc_text(start)} to {utc_text(end)}, "
                f"{sensor} {utc_text(first)} to {utc_text(last)}; {hint}"
            )


def _trajectory(chunks: list[Columns]) -> tuple[pd.DataFrame, int]:
    """All INS records in order of time; of equal times the first; how many that left out."""
    chunks = sorted(chunks, key=lambda columns: int(columns["t_ns"][0]))
    table = pd.DataFrame(
        {c.name: np.concatenate([columns[c.name] for columns in chunks]) for c in artefacts.TRAJECTORY.columns}
    )
    order = np.argsort(table["t_ns"].to_numpy(), kind="stable")
    table = table.iloc[order]
    keep = np.diff(table["t_ns"].to_numpy(), prepend=np.iinfo(np.int64).min // 2) > 0
    return table[keep].reset_index(drop=True), int((~keep).sum())


def _sigmas(pieces: list[tuple[str, Seen]], start: int, end: int) -> tuple[pd.DataFrame, int]:
    """What the INS states of its accuracy while it ran, in order of time; and how many rows lie outside."""
    for name in dict.fromkeys(name for name, seen in pieces if seen.accuracy):
        times = np.concatenate([seen.epochs_ns for other, seen in pieces if other == name])
        if not len(times):
            raise RawDataError(f"{name}: no usable accuracy record; export it again, or take it out of ins.accuracy")
        if times.max() < start or times.min() > end:
            raise RawDataError(
                f"{name}: no time overlap: ins {utc_text(start)} to {utc_text(end)}, "
                f"accuracy {utc_text(int(times.min()))} to {utc_text(int(times.max()))}; give the one of this SBET"
            )
    names = [column.name for column in artefacts.INS_SIGMAS.columns]
    told = [seen.sigmas for _, seen in pieces if seen.sigmas]
    if not told:
        return pd.DataFrame(columns=names), 0
    table = pd.DataFrame(thinned({name: np.concatenate([one[name] for one in told]) for name in names}))
    inside = table["t_ns"].between(start, end)
    return table[inside].reset_index(drop=True), int((~inside).sum())


def _pool_frame(trajectory: pd.DataFrame, target: config.TargetPlace) -> tuple[pd.DataFrame, PoolFrame]:
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
                "target.azimuth_deg is not given and the boat never had target.origin within 20 m to starboard; "
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


def _passes(
    trajectory: pd.DataFrame, frame: PoolFrame, pings: NDArray[np.int64], max_gap_ns: int, reversal_m: float
) -> pd.DataFrame:
    t_ns = trajectory["t_ns"].to_numpy()
    geodetic = (trajectory[name].to_numpy() for name in ("latitude_rad", "longitude_rad", "height_m"))
    points = frame.points_from_ecef(ecef_from_geodetic(*geodetic))
    passes = find_passes(t_ns, points[:, 1], pings, max_gap_ns, reversal_m)
    if not passes:
        raise RawDataError(
            "session.yaml: ins and mbes never ran together for a second without a gap above "
            f"{max_gap_ns / NS:g} s; check the logs, or raise ingest.max_gap_s"
        )
    starts, ends = (np.array(column, dtype=np.int64) for column in zip(*passes, strict=True))
    number = pass_of(t_ns, starts, ends)
    rows = []
    for k, (start, end) in enumerate(passes):
        inside = number == k
        along, athwart = points[inside, 1], np.abs(points[inside, 0])
        abeam = np.abs(along) <= athwart
        seconds = (end - start) / NS
        heading = trajectory["azimuth_rad"].to_numpy()[inside]
        mean = np.arctan2(np.sin(heading).mean(), np.cos(heading).mean()) if inside.any() else np.nan
        swing = np.sqrt(np.mean(np.angle(np.exp(1j * (heading - mean))) ** 2)) if inside.any() else np.nan
        rows.append(
            {
                "pass": k,
                "start_ns": start,
                "end_ns": end,
                "duration_s": seconds,
                "length_m": float(along[-1] - along[0]) if inside.any() else np.nan,
                "speed_m_s": abs(float(along[-1] - along[0])) / seconds if inside.any() else np.nan,
                "azimuth_deg": float(np.degrees(mean)),
                "heading_swing_deg": float(np.degrees(swing)),
                "distance_m": float(np.median(athwart[abeam] if abeam.any() else athwart)) if inside.any() else np.nan,
            }
        )
    return pd.DataFrame(rows)


def _files(partials: dict[str, list[tuple[str, Seen]]]) -> pd.DataFrame:
    rows = []
    for sensor, pieces in partials.items():
        by_file: dict[str, list[Seen]] = {}
        for name, seen in pieces:
            by_file.setdefault(name.split("#")[0], []).append(seen)
        for name, seen_list in by_file.items():
            epochs = np.concatenate([seen.epochs_ns for seen in seen_list])
            records = sum(seen.count for seen in seen_list)
            accuracy = any(seen.accuracy for seen in seen_list)
            if accuracy:
                records = len(epochs)
            rate = rate_hz(sensor, epochs, records)
            rows.append(
                {
                    "sensor": "accuracy" if accuracy else sensor,
                    "file": name,
                    "records": records,
                    "dropped": sum(sum(seen.dropped.values()) for seen in seen_list),
                    "first_ns": int(epochs.min()) if len(epochs) else -1,
                    "last_ns": int(epochs.max()) if len(epochs) else -1,
                    "rate_hz": rate,
                    "sound_speed_low_m_s": _finite(min(seen.lowest_speed_m_s for seen in seen_list)),
                    "sound_speed_high_m_s": _finite(max(seen.highest_speed_m_s for seen in seen_list)),
                }
            )
    return pd.DataFrame(rows)


def _finite(value: float) -> float:
    return value if np.isfinite(value) else np.nan


def _gaps(epochs_ns: dict[str, NDArray[np.int64]], max_gap_ns: int) -> pd.DataFrame:
    rows: list[dict[str, Any]] = []
    for sensor, t_ns in epochs_ns.items():
        stretches = split_at_gaps(t_ns, max_gap_ns)
        for (_, end), (start, _) in pairwise(stretches):
            rows.append({"sensor": sensor, "start_ns": end, "end_ns": start, "duration_s": (start - end) / NS})
    return pd.DataFrame(rows, columns=[column.name for column in artefacts.GAPS.columns])


def _counts(
    partials: dict[str, list[tuple[str, Seen]]], repeated: dict[str, int], sigmas_outside: int
) -> pd.DataFrame:
    rows = []
    for source, pieces in partials.items():
        total: dict[str, int] = {"used": 0, "repeated time": repeated.get(source, 0)}
        for _, seen in pieces:
            total["used"] += seen.count
            for reason, number in seen.dropped.items():
                total[reason] = total.get(reason, 0) + number
        total["used"] -= total["repeated time"]
        if source == "ins" and sigmas_outside:
            total["accuracy outside the INS's time"] = sigmas_outside
        rows += [{"source": source, "reason": reason, "count": number} for reason, number in sorted(total.items())]
    return pd.DataFrame(rows)
