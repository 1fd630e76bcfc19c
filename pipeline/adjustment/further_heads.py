"""The soundings of a further head of the sonar, with the passes of the run in which they are adjusted.

Each further head has a run of its own up to its labels, whose passes may begin and end with other pings. A label is
the number of a face, and a labelled sounding lies in the frame of its head: both are the same in every run of a
session. So only the numbers of the passes are made anew, and soundings outside all passes of this run are left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.streams import Batch, Stream
from pipeline.errors import RawDataError
from pipeline.maths.geometry.passes import pass_of

Times = NDArray[np.int64]


@dataclass(frozen=True)
class InPasses:
    """Leaves the rows of a batch that lie in passes, by their times, with the numbers of these passes."""

    starts_ns: Times
    ends_ns: Times

    def __call__(self, batch: Batch) -> Batch:
        """Return the rows that are left."""
        number = pass_of(batch["t_ns"], self.starts_ns, self.ends_ns)
        rows = np.flatnonzero(number >= 0)
        columns = {name: values[rows] for name, values in batch.items()}
        return columns | {"pass": number[rows]} if "pass" in columns else columns


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
        found[head] = stream.changed(InPasses(starts, ends))
        if not any(True for _ in found[head].only(("t_ns",)).batches()):
            raise RawDataError(
                f"{head}: none of its soundings on the target lies in a pass of the first head; calibrate the heads "
                "in sessions of their own, or look whether a file of the first head is missing"
            )
    return found
