"""Gather a sonar's pings into chunks of soundings of bounded size, and check their rows."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.readers.row_checks import keep_possible_soundings, latency_ns, possible_ns
from pipeline.readers.row_filter import MBES_COLUMNS, RowFilter, chunk, no_rows

CHUNK_SOUNDINGS = 131_072  # minimum of a chunk; it has at most one ping more
CHUNK_PINGS = 8_192
MAX_BEAMS = np.iinfo(np.int16).max  # of a ping: the type of the column beam
NO_TILT_DEG = 0.005  # a sector is not tilted if its tilt is no larger
PingT = TypeVar("PingT")


def chunks_of_pings(
    pings: Iterable[PingT],
    n_soundings: Callable[[PingT], int],
    chunk_of: Callable[[list[PingT]], Chunk],
    dropped: Counter[str],
) -> Iterator[Chunk]:
    """Yield chunks of pings, and at the end a chunk without rows if something was left out after the last ping.

    Parameters
    ----------
    pings
        A file's pings, which are taken one by one.
    n_soundings
        Returns the number of a ping's soundings.
    chunk_of
        Makes a chunk of successive pings, and empties ``dropped`` into it.
    dropped
        Counts of what was left out so far, by reason.
    """
    group: list[PingT] = []
    soundings = 0
    for ping in pings:
        group.append(ping)
        soundings += n_soundings(ping)
        if soundings >= CHUNK_SOUNDINGS or len(group) >= CHUNK_PINGS:
            yield chunk_of(group)
            group, soundings = [], 0
    if soundings:
        yield chunk_of(group)
    if dropped:
        yield no_rows(MBES_COLUMNS, dropped)


def single_beam_error(name: str) -> RawDataError:
    """Return the refusal of a file whose pings are of one beam."""
    return RawDataError(
        f"{name}: its pings are of one beam (a single-beam echo sounder), which sees no planes; give the "
        "files of a multibeam sonar"
    )


def per_sounding(values: Sequence[Any] | NDArray[Any], counts: NDArray[np.int64], dtype: Any) -> NDArray[Any]:
    """Return values of pings (n,), each repeated for the ping's ``counts`` soundings."""
    return np.repeat(np.asarray(values, dtype=dtype), counts)


def beam_numbers(counts: NDArray[np.int64]) -> NDArray[np.int16]:
    """Return the numbers of beams from 0 in each ping, for pings of ``counts`` soundings."""
    return np.concatenate([np.arange(count, dtype=np.int16) for count in counts])


def checked_chunk(rows: RowFilter, latency_s: float) -> Chunk:
    """Return a chunk of the possible soundings, with the latency taken off their times."""
    rows.keep(possible_ns(rows["t_ns"]), "impossible time (clock not set)")
    keep_possible_soundings(rows)
    rows.columns["t_ns"] = rows["t_ns"] - latency_ns(latency_s)
    return chunk(rows.columns, MBES_COLUMNS, rows.dropped)
