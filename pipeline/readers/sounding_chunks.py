"""Gather a sonar's pings into chunks of soundings of limited size, and check their rows."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.readers.row_checks import keep_possible_soundings, latency_ns, possible_ns
from pipeline.readers.row_filter import MBES_COLUMNS, RowFilter, chunk, no_rows

CHUNK_SOUNDINGS = 131_072  # a chunk ends with the ping that reaches this number,
CHUNK_PINGS = 8_192  # or this number of pings
MAX_BEAMS = np.iinfo(np.int16).max  # most beams of a ping; column beam has this type
NO_TILT_DEG = 0.005  # a sector with this tilt or less counts as not tilted
PingT = TypeVar("PingT")


def chunks_of_pings(
    pings: Iterable[PingT],
    n_soundings: Callable[[PingT], int],
    chunk_of: Callable[[list[PingT]], Chunk],
    dropped: Counter[str],
) -> Iterator[Chunk]:
    """Yield chunks of pings, and at the end a chunk without rows if ``dropped`` still has counts.

    Parameters
    ----------
    pings
        A file's pings, which are read one by one.
    n_soundings
        Function that returns the number of a ping's soundings.
    chunk_of
        Function that makes a chunk of successive pings, and moves the counts of ``dropped`` into it.
    dropped
        Counts of rows left out so far, by reason.
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
    """Return the error for a file whose pings have one beam."""
    return RawDataError(
        f"{name}: its pings are of one beam (a single-beam echo sounder), which sees no planes; give the "
        "files of a multibeam sonar"
    )


def per_sounding(values: Sequence[Any] | NDArray[Any], counts: NDArray[np.int64], dtype: Any) -> NDArray[Any]:
    """Return one value per sounding: each ping's value (n,), repeated ``counts`` (n,) times."""
    return np.repeat(np.asarray(values, dtype=dtype), counts)


def beam_numbers(counts: NDArray[np.int64]) -> NDArray[np.int16]:
    """Return one beam number per sounding, from 0 in each ping; ``counts`` (n,): numbers of the pings' soundings."""
    return np.concatenate([np.arange(count, dtype=np.int16) for count in counts])


def checked_chunk(rows: RowFilter, latency_s: float) -> Chunk:
    """Return a chunk of the possible soundings, with the latency subtracted from their times."""
    rows.keep(possible_ns(rows["t_ns"]), "impossible time (clock not set)")
    keep_possible_soundings(rows)
    rows.columns["t_ns"] = rows["t_ns"] - latency_ns(latency_s)
    return chunk(rows.columns, MBES_COLUMNS, rows.dropped)
