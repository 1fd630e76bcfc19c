"""The soundings of a further head of the sonar, with the passes of the run in which they are adjusted.

Each further head has a run of its own up to its labels, whose passes may begin and end with other pings. A label is
the number of a face, and a labelled sounding lies in the frame of its head: both are the same in every run of a
session. So only the numbers of the passes are made anew, and soundings outside all passes of this run are left out.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk, Part, Stream, only, pieces
from pipeline.errors import RawDataError
from pipeline.maths.geometry.passes import pass_of

Times = NDArray[np.int64]


@dataclass(frozen=True)
class PartInPasses:
    """The rows of a part that lie in passes, by their times, with the numbers of these passes."""

    part: Part
    starts_ns: Times
    ends_ns: Times

    @property
    def name(self) -> str:
        """Name of the part."""
        return self.part.name

    def only(self, columns: tuple[str, ...]) -> "PartInPasses":
        """Return the part with these columns alone, if it can be read so."""
        return replace(self, part=only(self.part, columns))

    def pieces(self) -> Sequence["PartInPasses"]:
        """Return the part in pieces, if it can be read so."""
        return [replace(self, part=piece) for piece in pieces(self.part)]

    def chunks(self) -> Iterator[Chunk]:
        """Yield the rows, as the part does."""
        for chunk in self.part.chunks():
            number = pass_of(chunk.columns["t_ns"], self.starts_ns, self.ends_ns)
            rows = np.flatnonzero(number >= 0)
            columns = {name: values[rows] for name, values in chunk.columns.items()}
            if "pass" in columns:
                columns["pass"] = number[rows]
            if len(rows):
                yield replace(chunk, columns=columns)


def in_passes(streams: Mapping[str, Stream], passes: pd.DataFrame) -> dict[str, Stream]:
    """Return the labelled soundings of further heads that lie in these passes (table passes), by head.

    Raises
    ------
    RawDataError
        A head has none.
    """
    starts, ends = (passes[name].to_numpy(np.int64) for name in ("start_ns", "end_ns"))
    found = {}
    for head, stream in streams.items():
        parts = tuple(PartInPasses(part, starts, ends) for part in stream.parts)
        found[head] = replace(stream, parts=parts)
        if not any(True for _ in found[head].only(("t_ns",)).batches()):
            raise RawDataError(
                f"{head}: none of its soundings on the target lies in a pass of the first head; calibrate the heads "
                "in sessions of their own, or look whether a file of the first head is missing"
            )
    return found
