"""A cast of sound speed out of a file: ``mbes.svp: casts/today.svp`` in session.yaml becomes depths and speeds.

What is done to its rows is told in :class:`config.CastUsed` (run.yaml, calibration.json): rows above the surface, of
speeds that no water has, or deeper than 200 m are left out and counted; of a way down and up the way down is used, and
a file in which the two differ by more than 2 m/s is refused; rows of one depth become their mean; and the rest is
thinned (``maths/sonar/cast_profile.py``). Nothing is filled in: beyond the cast's ends the speed stays
(``maths/sonar/ray_tracing.py``).
"""

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.config.recording import inside_session
from pipeline.errors import ConfigError, RawDataError
from pipeline.maths.sonar.cast_profile import TOLERANCE_M_S, ascending, largest_difference, one_way, thinned_profile
from pipeline.readers.cast_text import Cast, casts_of
from pipeline.readers.dispatch import found
from pipeline.readers.raw_file import opened

Array = NDArray[np.float64]
LARGEST = 20_000_000  # bytes
DEEPEST_M = 200.0
SLOWEST_M_S, FASTEST_M_S = 1300.0, 1700.0  # of water
FEET = 0.3048
APART_M_S = 2.0  # between the ways down and up
MOST_SCATTER_M_S = 0.5  # of rows about the profile
JUMP_M_S, WITHIN_M = 10.0, 0.5  # from row to row: more is a bubble, or air
MOST_LISTED = 10


def with_cast(content: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """session.yaml's content with the cast in place of the name of its file.

    Raises
    ------
    ConfigError, RawDataError
        The file is not there, holds several casts, or none that can be used.
    """
    block = content.get("mbes")
    if not isinstance(block, dict):
        return dict(content)
    where = f"{folder / 'session.yaml'}: mbes"
    if "svp_from" in block:
        raise ConfigError(f"{where}.svp_from: is written by poolcal, in run.yaml; take it out")
    given, number = block.get("svp"), block.get("svp_number")
    if not isinstance(given, str):
        if number is not None:
            raise ConfigError(
                f"{where}.svp_number = {number!r}: belongs to a file of casts, but mbes.svp names none; name the file "
                "there, or take svp_number out"
            )
        return dict(content)
    try:
        inside_session(given)
    except ValueError as error:
        raise ConfigError(f"{where}.svp = {given!r}: {error}") from error
    paths = found(folder, [given], "mbes.svp")
    names = [path.relative_to(folder).as_posix() for path in paths]
    if len(paths) > 1:
        raise ConfigError(f"{where}.svp = {given!r}: matches {len(paths)} files ({', '.join(names[:3])}); name one")
    if not names[0].isprintable():
        raise RawDataError(f"{names[0]!a}: the cast's name has letters that cannot be shown; rename the file")
    svp, used = read_cast(paths[0], names[0], number)
    return dict(content) | {"mbes": block | {"svp": svp, "svp_from": used}}


def read_cast(path: Path, name: str, number: Any = None) -> tuple[list[list[float]], dict[str, Any]]:
    """Depths (m) and speeds (m/s), and how they came to be (config.CastUsed)."""
    with opened(path, name) as file:
        content = file.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise RawDataError(f"{name}: has more than {LARGEST // 1_000_000} MB, too much for a cast; name the right file")
    kind, casts = casts_of(_text(content, name), name)
    cast, chosen = _chosen(casts, number, name)
    depth, speed, left_out = _cleaned(np.array(cast.rows, dtype=np.float64).reshape(-1, 2), name)
    profile = thinned_profile(depth, speed)
    if profile.scatter_m_s > MOST_SCATTER_M_S:
        raise RawDataError(
            f"{name}: its sound speeds scatter by {profile.scatter_m_s:.1f} m/s about their mean at a depth; check the "
            "probe"
        )
    svp = [[round(float(d), 4), round(float(c), 4)] for d, c in zip(profile.depth_m, profile.speed_m_s, strict=True)]
    return svp, {
        "file": name,
        "sha256": hashlib.sha256(content).hexdigest(),
        "kind": kind,
        "number": chosen,
        "casts": len(casts),
        "taken": cast.taken.isoformat(sep=" ") if cast.taken else None,
        "place_deg": None if cast.place_deg is None else list(cast.place_deg),
        "rows": len(cast.rows),
        "left_out": dict(sorted(left_out.items())),
        "first_m": svp[0][0],
        "last_m": svp[-1][0],
        "tolerance_m_s": TOLERANCE_M_S,
        "averaged_m": profile.averaged_m,
        "scatter_m_s": round(profile.scatter_m_s, 4),
    }


def _text(content: bytes, name: str) -> str:
    for mark, code in ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"), (b"\xef\xbb\xbf", "utf-8-sig")):
        if content.startswith(mark):
            return content.decode(code, "replace")
    if b"\0" in content:
        raise RawDataError(f"{name}: is no text, and so no cast; export it as CARIS .svp, or as columns")
    try:
        return content.decode()
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _chosen(casts: Sequence[Cast], number: Any, name: str) -> tuple[Cast, int]:
    if number is None and len(casts) == 1:
        return casts[0], 1
    if isinstance(number, int) and 1 <= number <= len(casts):
        return casts[number - 1], number
    listed = ", ".join(f"{k + 1}: {cast.taken or 'no time'}" for k, cast in enumerate(casts[:MOST_LISTED]))
    more = ", ..." if len(casts) > MOST_LISTED else ""
    asked = "holds" if number is None else f"has no cast {number}: it holds"
    raise RawDataError(
        f"{name}: {asked} {len(casts)} cast{'s' * (len(casts) > 1)} ({listed}{more}); give mbes.svp_number, the number "
        "of the one taken at the session"
    )


# --- rows ------------------------------------------------------------------------------------------------------------
def _cleaned(rows: Array, name: str) -> tuple[Array, Array, Counter[str]]:
    """Depths ascending, speeds, and what was left out."""
    left_out: Counter[str] = Counter()

    def keep(good: NDArray[np.bool_], reason: str) -> None:
        nonlocal rows
        if not np.all(good):
            left_out[reason] += int(np.count_nonzero(~good))
            rows = rows[good]

    keep(np.all(np.isfinite(rows), axis=1), "no depth or no speed")
    if not len(rows):
        raise RawDataError(f"{name}: has no row of a depth and a sound speed; export it again")
    if np.mean(rows[:, 0] < 0) > 0.5:
        raise RawDataError(f"{name}: its depths are negative ({rows[:, 0].min():g}); give metres, positive downward")
    _refuse_speeds(rows[:, 1], name)
    keep((rows[:, 1] >= SLOWEST_M_S) & (rows[:, 1] <= FASTEST_M_S), "in air, or a speed that no water has")
    keep(rows[:, 0] >= 0, "above the surface")
    keep(rows[:, 0] <= DEEPEST_M, f"deeper than {DEEPEST_M:g} m")
    if len(rows):
        used = one_way(rows[:, 0])
        _refuse_other_way(rows, used, name)
        keep(np.isin(np.arange(len(rows)), used), "on the way up")
    depth, speed = ascending(*rows.T)
    if len(depth) < 2:
        raise RawDataError(
            f"{name}: the number of its depths that can be used is {len(depth)}, and a cast needs two; export all of it"
        )
    if len(depth) < len(rows):
        left_out["of a depth that is there already: their mean is used"] = len(rows) - len(depth)
    _refuse_jumps(depth, speed, name)
    return depth, speed, left_out


def _refuse_speeds(speed: Array, name: str) -> None:
    middle = float(np.median(speed))
    if SLOWEST_M_S <= middle <= FASTEST_M_S:
        return
    feet = SLOWEST_M_S <= middle * FEET <= FASTEST_M_S
    cause = "feet a second, it seems" if feet else "water has 1300 to 1700 m/s"
    raise RawDataError(
        f"{name}: its sound speeds are near {middle:.6g}: {cause}; export depth in metres and sound speed in m/s"
    )


def _refuse_other_way(rows: Array, used: NDArray[np.int64], name: str) -> None:
    other = np.setdiff1d(np.arange(len(rows)), used)
    if len(other) < 2:
        return
    apart, depth = largest_difference(ascending(*rows[used].T), ascending(*rows[other].T))
    if apart > APART_M_S:
        raise RawDataError(
            f"{name}: the ways down and up differ by {apart:.1f} m/s at {depth:.2f} m: the water changed, or the probe "
            "lags; leave in the file the one to be used"
        )


def _refuse_jumps(depth: Array, speed: Array, name: str) -> None:
    step = np.where(np.diff(depth) < WITHIN_M, np.abs(np.diff(speed)), 0.0)
    worst = int(np.argmax(step))
    if step[worst] > JUMP_M_S:
        raise RawDataError(
            f"{name}: the sound speed jumps from {speed[worst]:.1f} m/s at {depth[worst]:.2f} m to "
            f"{speed[worst + 1]:.1f} at {depth[worst + 1]:.2f} m: the probe was partly in air, or in a bubble; take "
            "such rows out"
        )
