"""Checks of the track: the boat is at the target, passes it as required, and every sensor runs in every pass."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.file_survey import Columns, SurveyedFile
from pipeline.checking.findings import Finding
from pipeline.checking.track import InsTrack, askew_deg
from pipeline.config.pool import PoolConfig, TargetPlace
from pipeline.config.target import Origin
from pipeline.console import plural
from pipeline.gps_time import NS, utc_text
from pipeline.maths.geometry.geodesy import PoolFrame, ecef_from_geodetic
from pipeline.maths.target.model import TargetModel

Times = NDArray[np.int64]
ASTRAY_M = 1_000.0
NEARBY_M = 60.0
HIGHEST_M = 15.0  # largest height of the INS above the target's upper end, or depth below its lower end
ALIKE_M = 0.5  # passes whose distances differ by less separate yaw and lever arm y badly
RAN, NOT = 0.6, 0.2  # share of a pass: from the first on a sensor ran, below the second it did not run
ASKEW_DEG = 15.0  # angle between the boat's direction and the target's +y that no coarse azimuth explains
HOLE_S = 0.3  # shortest hole in the INS's log that counts


def origin_findings(ins: Columns, pool: PoolConfig, model: TargetModel) -> Iterator[Finding]:
    """Yield findings if the track is far from target.origin. Then no further question is asked about the target.

    Parameters
    ----------
    ins : Columns
        The INS's records.
    pool : PoolConfig
        The pool's settings.
    model : TargetModel
        The target.
    """
    origin = pool.target.origin
    away = _away_m(ins, origin.latitude_deg, origin.longitude_deg)
    if away > ASTRAY_M:
        given = f"{origin.latitude_deg:g}, {origin.longitude_deg:g}"
        middle = np.degrees([np.median(ins["latitude_rad"]), np.median(ins["longitude_rad"])])
        track = f"the INS's track ({middle[0]:.5f}, {middle[1]:.5f})"
        words = f"target.origin ({given}) is {away / 1000:.4g} km from {track}: {_why_astray(ins, origin)}"
        yield Finding("origin", words)
    elif away > NEARBY_M:
        yield Finding("origin", f"the INS never comes nearer to target.origin than {away:.0f} m; check target.origin")
    above = float(np.median(ins["height_m"])) - origin.height_m
    low, high = model.bounds()
    if away <= ASTRAY_M and not low[2] - HIGHEST_M <= above <= high[2] + HIGHEST_M:
        yield Finding(
            "height",
            f"the INS runs {abs(above):.1f} m {'above' if above > 0 else 'below'} target.origin.height_m = "
            f"{origin.height_m:g}: one of the two is above sea level, not above the ellipsoid (the undulation would be "
            f"{abs(above):.0f} m, less the INS's height above the origin); give both ellipsoidal",
        )


def _away_m(ins: Columns, latitude_deg: float, longitude_deg: float) -> float:
    """Return the smallest horizontal distance (m) of the track from a place; infinite for an impossible latitude."""
    if not -90 <= latitude_deg <= 90:
        return np.inf
    frame = PoolFrame.at(np.radians(latitude_deg), np.radians(longitude_deg), 0.0, 0.0)
    level = ecef_from_geodetic(ins["latitude_rad"], ins["longitude_rad"], np.zeros(len(ins["t_ns"])))
    return float(np.linalg.norm(frame.points_from_ecef(level), axis=1).min())


def _why_astray(ins: Columns, origin: Origin) -> str:
    """Return the likely error of target.origin that explains its distance from the track, and the remedy."""
    latitude, longitude = origin.latitude_deg, origin.longitude_deg
    for words, place in (
        ("latitude and longitude are interchanged", (longitude, latitude)),
        ("latitude_deg has the wrong sign", (-latitude, longitude)),
        ("longitude_deg has the wrong sign", (latitude, -longitude)),
        ("latitude_deg and longitude_deg have the wrong sign", (-latitude, -longitude)),
    ):
        if _away_m(ins, *place) < ASTRAY_M:
            return f"{words}; correct it"
    return "check target.origin, and that these are this pool's files"


def sailing_findings(track: InsTrack, place: TargetPlace) -> Iterator[Finding]:
    """Yield findings if there is no pass, if passes are on the wrong side or askew, or if all are at one distance.

    ``place`` holds the configured azimuth.
    """
    sounded = [leg for leg in track.legs if max(leg.ran.values()) > NOT]
    legs = f"in {'all ' * (len(track.legs) > 1)}{plural(len(track.legs), 'pass')}"
    if not track.legs:
        remedy = azimuth_remedy(track, place) or "check target.origin"
        yield Finding("passes", f"the boat never passes the target: {remedy}")
    elif all(leg.distance_m < 0 for leg in track.legs):
        given = place.azimuth_deg
        turned = "" if given is None else f" ({(given + 180) % 360:g} in place of {given:g})"
        words = f"{legs} the boat sails behind the target (x > 0): turn target.azimuth_deg by 180°{turned}"
        yield Finding("side", f"{words}, or check target.origin")
    elif not any(leg.good for leg in track.legs):
        astern = [leg for leg in track.legs if leg.astern]
        words = f"{legs} the boat sails with the target to port, where the sonar by mbes.mount does not look"
        if len(astern) > len(track.legs) / 2:
            yield Finding("side", f"{words}, stern first by its heading: is the INS's heading turned by 180°?")
        else:
            yield Finding("side", f"{words}: sail the other way, or check mbes.mount.roll_deg")
    elif askew := azimuth_remedy(track, place):
        yield Finding("azimuth", f"the boat does not sail along the target: {askew}")
    distances = [leg.distance_m for leg in sounded if leg.good]
    if distances and np.ptp(distances) < ALIKE_M:
        yield Finding(
            "distances",
            f"all passes are {np.mean(distances):.1f} m from the wall (within {np.ptp(distances):.1f} m): only "
            "different distances separate yaw from lever arm y; sail some more passes, 2 m nearer or farther",
            "look",
        )


def survey_findings(pool: PoolConfig) -> Iterator[Finding]:
    """Yield a finding if the pool's file says nothing of the target as built: the defaults are the best target's."""
    if "as_built" not in pool.model_fields_set:
        best = pool.as_built
        yield Finding(
            "survey",
            "the pool's file has no as_built: the sigmas will count on a target whose faces were surveyed one by one, "
            f"to {1000 * best.face_sigma_m:g} mm, with the pool filled; say how yours was (as_built)",
            "look",
        )


def azimuth_remedy(track: InsTrack, place: TargetPlace) -> str:
    """Return the remedy for an azimuth far from the boat's direction; an empty text if it is near or one is unknown."""
    turn = askew_deg(track)
    if turn is None or place.azimuth_deg is None or abs(turn) < ASKEW_DEG:
        return ""
    sailed = round(place.azimuth_deg + turn) % 360
    return (
        f"it heads {sailed}° with target.origin to starboard (the other way with it to port), but target.azimuth_deg "
        f"is {place.azimuth_deg:g} (the direction of the target's +y, along which it is sailed): write {sailed}, or "
        "check target.origin"
    )


def missing_pass_findings(track: InsTrack, files: Sequence[SurveyedFile]) -> Iterator[Finding]:
    """Yield a finding for each good pass in which one sensor ran, and the other did not or only for a part."""
    there = {file.sensor for file in files if file.records} - {file.sensor for file in files if not file.ended}
    for leg in track.legs:
        if not leg.good or not {"laser", "mbes"} <= there:
            continue
        for running, silent in (("laser", "mbes"), ("mbes", "laser")):
            when = f"{utc_text(leg.start_ns)}, at {leg.distance_m:.1f} m"
            if leg.ran[running] >= RAN and leg.ran[silent] < RAN:
                part = "did not run" if leg.ran[silent] < NOT else f"ran for only {leg.ran[silent]:.0%} of the time"
                yield Finding(
                    "missing pass",
                    f"{silent}: {part} in the pass of {when}, while {running} did: find its file, or sail the pass "
                    "again",
                )


def ins_hole_findings(
    track: InsTrack, epochs: dict[str, Times], max_interval_s: float, coarse_ns: float
) -> Iterator[Finding]:
    """Yield one finding for all holes in the INS's log while the boat passed the target and a sensor ran.

    Parameters
    ----------
    track : InsTrack
        The INS's track.
    epochs : dict[str, Times]
        By sensor the times of its records.
    max_interval_s : float
        The longest interval between two INS records that is interpolated over.
    coarse_ns : float
        ``coarseness_ns`` of the INS's files, the largest; 0 if they were read whole.
    """
    t_ns, y = track.trajectory.t_ns, track.trajectory.positions_m[:, 1]
    by = [np.abs(y[(t_ns >= leg.start_ns) & (t_ns <= leg.end_ns)]).max() for leg in track.legs]
    reach = float(max(by, default=0.0))
    first = np.flatnonzero(np.diff(t_ns) > max(max_interval_s * NS, 1.5 * coarse_ns))
    runs = np.unique(np.concatenate([np.empty(0, np.int64), *epochs.values()]))
    lost = []
    for k in first.tolist():
        ran = np.count_nonzero((runs > t_ns[k]) & (runs < t_ns[k + 1]))
        beside = min(y[k], y[k + 1]) < reach and max(y[k], y[k + 1]) > -reach and y[k + 1] >= y[k]
        if ran and beside and (t_ns[k + 1] - t_ns[k]) / NS >= HOLE_S:
            lost.append((int(t_ns[k]), (t_ns[k + 1] - t_ns[k]) / NS))
    if lost:
        longest = max(lost, key=lambda hole: hole[1])
        yield Finding(
            "ins hole",
            f"ins: {plural(len(lost), 'hole')} in its log while the boat passed the target, "
            f"{sum(s for _, s in lost):.1f} s together, the longest {longest[1]:.1f} s from {utc_text(longest[0])}: "
            "points in them are lost; log without pause, or give the files that are missing",
        )
