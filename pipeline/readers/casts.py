"""Replace a cast's file name in session.yaml (``mbes.svp: casts/today.svp``) by the cast's depths and speeds.

:class:`pipeline.config.references.CastUsed` (run.yaml, calibration.json) records how the rows were chosen and thinned.
Rows above the surface, rows deeper than 200 m, and rows with speeds outside 1300 to 1700 m/s are left out and counted.
If a cast has a way down and a way up, only the way down is used. The cast is refused if the speeds on the two differ by
more than 2 m/s. Rows of the same depth are replaced by their mean. Then the profile is thinned
(``maths/sonar/cast_profile.py``). No depths are added: above the first depth and below the last one, ray tracing uses
the speed at that depth (``maths/sonar/ray_tracing.py``).
"""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.config.heads import HEADS
from pipeline.config.recording import inside_session
from pipeline.errors import ConfigError, RawDataError
from pipeline.maths.sonar.cast_profile import TOLERANCE_M_S, thinned_profile
from pipeline.readers.cast_checks import usable_rows
from pipeline.readers.cast_text import casts_of
from pipeline.readers.cast_values import RecordedCast
from pipeline.readers.raw_file import opened
from pipeline.readers.session_files import files_matching

MAX_BYTES = 20_000_000
MAX_SCATTER_M_S = 0.5  # RMS of the rows' speeds about the profile
MAX_LISTED = 10  # casts that a message lists


def with_cast(content: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return session.yaml's content with the cast's rows in place of its file's name, and their record ``svp_from``.

    Each head of the sonar has a block of its own in the content, and its cast in it.

    Raises
    ------
    ConfigError, RawDataError
        The keys contradict each other, the file does not exist, no number chooses among several casts, or the cast
        cannot be used.
    """
    blocks = {head: content[head] for head in HEADS if isinstance(content.get(head), dict)}
    return dict(content) | {head: _block_with_cast(head, block, folder) for head, block in blocks.items()}


def _block_with_cast(head: str, block: dict[str, Any], folder: Path) -> dict[str, Any]:
    where = f"{folder / 'session.yaml'}: {head}"
    if "svp_from" in block:
        raise ConfigError(f"{where}.svp_from: is written by poolcal, in run.yaml; take it out")
    pattern, number = block.get("svp"), block.get("svp_number")
    if not isinstance(pattern, str):
        if number is not None:
            raise ConfigError(
                f"{where}.svp_number = {number!r}: belongs to a file of casts, but {head}.svp names none; name the "
                "file there, or take svp_number out"
            )
        return block
    try:
        inside_session(pattern)
    except ValueError as error:
        raise ConfigError(f"{where}.svp = {pattern!r}: {error}") from error
    files = files_matching(folder, [pattern], f"{head}.svp")
    if len(files) > 1:
        names = ", ".join(file.name for file in files[:3])
        raise ConfigError(f"{where}.svp = {pattern!r}: matches {len(files)} files ({names}); name one")
    (file,) = files
    if not file.name.isprintable():
        raise RawDataError(f"{file.name!a}: the cast's name has letters that cannot be shown; rename the file")
    svp, used = read_cast(file.path, file.name, number)
    return block | {"svp": svp, "svp_from": used}


def read_cast(path: Path, name: str, number: Any = None) -> tuple[list[list[float]], dict[str, Any]]:
    """Return a cast's thinned rows of depth [m] and speed [m/s], and the record of their making (``CastUsed``).

    Parameters
    ----------
    path, name
        The file, and its name in messages.
    number
        Number of the cast in the file, from 1; None: the file must hold exactly one cast.

    Raises
    ------
    RawDataError
        The file is too large or cannot be read, does not hold that cast, or the cast cannot be used.
    """
    with opened(path, name) as file:
        content = file.read(MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise RawDataError(
            f"{name}: has more than {MAX_BYTES // 1_000_000} MB, too much for a cast; name the right file"
        )
    kind, casts = casts_of(_text(content, name), name)
    cast, chosen_number = _chosen(casts, number, name)
    rows = usable_rows(np.array(cast.rows, dtype=np.float64).reshape(-1, 2), name)
    profile = thinned_profile(rows.depth_m, rows.speed_m_s)
    if profile.scatter_m_s > MAX_SCATTER_M_S:
        raise RawDataError(
            f"{name}: its sound speeds scatter by {profile.scatter_m_s:.1f} m/s about their mean at a depth; check the "
            "probe"
        )
    svp = [[round(float(d), 4), round(float(c), 4)] for d, c in zip(profile.depth_m, profile.speed_m_s, strict=True)]
    return svp, {
        "file": name,
        "sha256": hashlib.sha256(content).hexdigest(),
        "kind": kind,
        "number": chosen_number,
        "casts": len(casts),
        "taken": cast.taken.isoformat(sep=" ") if cast.taken else None,
        "place_deg": None if cast.place_deg is None else list(cast.place_deg),
        "rows": len(cast.rows),
        "left_out": dict(sorted(rows.left_out.items())),
        "first_m": svp[0][0],
        "last_m": svp[-1][0],
        "tolerance_m_s": TOLERANCE_M_S,
        "averaged_m": profile.averaged_m,
        "scatter_m_s": round(profile.scatter_m_s, 4),
    }


def _text(content: bytes, name: str) -> str:
    """Return the file's text: UTF-16 or UTF-8 by its byte-order mark, else UTF-8 if valid, else Latin-1."""
    for mark, code in ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"), (b"\xef\xbb\xbf", "utf-8-sig")):
        if content.startswith(mark):
            return content.decode(code, "replace")
    if b"\0" in content:
        raise RawDataError(f"{name}: is no text, and so no cast; export it as CARIS .svp, or as columns")
    try:
        return content.decode()
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _chosen(casts: Sequence[RecordedCast], number: Any, name: str) -> tuple[RecordedCast, int]:
    """Return the cast that mbes.svp_number chooses (without svp_number the file's only cast), and its number."""
    if number is None and len(casts) == 1:
        return casts[0], 1
    if isinstance(number, int) and 1 <= number <= len(casts):
        return casts[number - 1], number
    listed = ", ".join(f"{k + 1}: {cast.taken or 'no time'}" for k, cast in enumerate(casts[:MAX_LISTED]))
    more = ", ..." if len(casts) > MAX_LISTED else ""
    asked = "holds" if number is None else f"has no cast {number}: it holds"
    raise RawDataError(
        f"{name}: {asked} {len(casts)} cast{'s' * (len(casts) > 1)} ({listed}{more}); give mbes.svp_number, the number "
        "of the one taken at the session"
    )
