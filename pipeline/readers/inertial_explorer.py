"""NovAtel Inertial Explorer's text exports (Waypoint), of any layout (``inertial_explorer_layout``).

Axes and angles are those of this project: z up, y forward, x to the right; R_level_from_body = Rz(-heading) Rx(pitch)
Ry(roll). The heading is clockwise from true north (Waypoint Software User Manual, OM-20000166: "yaw = -heading"), and
may run from -180 to 180. Heights are ellipsoidal (H-Ell), or H-MSL + Undulation. Times are GPS seconds of week with
Week, with a date, or with ``ins.gps_week`` (the week in which the file begins); or they are UTC with UTCDate
(``inertial_explorer_times``). An angle in three columns has its sign at the degrees, also at -0.

Q is the quality of the position, from 1 to 6. Rows with Q 4 (0.5 to 2 m) or worse are left out, because the target is
searched within 0.5 m. SDNorth, SDEast, SDHeight, RollSD, PitchSD and HdngSD are used as the INS's own sigmas. Other
columns are ignored. Rows with another number of columns (footers, cut lines), rows with a word in place of a number,
and a last line without line end are left out and counted.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.artefacts.streams import Chunk
from pipeline.readers.float32_checks import refuse_float32
from pipeline.readers.inertial_explorer_layout import ExportLayout, read_layout
from pipeline.readers.inertial_explorer_rows import read_blocks
from pipeline.readers.inertial_explorer_times import keep_possible_times
from pipeline.readers.inertial_explorer_units import POSITION, SIGMA_COLUMN_NAMES
from pipeline.readers.raw_file import opened
from pipeline.readers.row_checks import keep_possible_poses, latency_ns, sigma_rows
from pipeline.readers.row_filter import INS_COLUMNS, Columns, RowFilter, TimeOrder, chunk, no_rows
from pipeline.readers.sbet import running_weeks

WORST_Q = 3


@dataclass(frozen=True)
class InertialExplorerPart:
    """One export file."""

    path: Path
    name: str
    gps_week: int | None  # week of the first row; None: the file has weeks or dates
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        """Yield the INS records in canonical columns, with their sigmas, block by block."""
        layout = read_layout(self.path, self.name)
        dropped: Counter[str] = Counter()
        order, week, last, first = TimeOrder(self.name), self.gps_week or 0, -np.inf, True
        with opened(self.path, self.name) as file:
            for columns in read_blocks(file, layout, self.name, dropped):
                if first:
                    _refuse_float32(columns, layout, self.name)
                    first = False
                if layout.clock == "gps_week" and len(columns["gpstime"]):
                    weeks, week, last = running_weeks(columns["gpstime"], week, last)
                    columns["week"] = weeks.astype(np.float64)
                yield _chunk(columns, layout, order, self.latency_s, dropped)
            if dropped:
                yield no_rows(INS_COLUMNS, dropped)
        order.check()


def _refuse_float32(columns: Columns, layout: ExportLayout, name: str) -> None:
    """Refuse numbers that were stored as float32 before they were printed.

    Each of them lies within half a printed step of a float32 number. The test counts only numbers at which neighbouring
    float32 numbers are more than four printed steps apart.
    """
    rounded_columns = {}
    for column, step in layout.steps.items():
        values = columns[layout.time if column == "time" else column]
        with np.errstate(all="ignore"):
            single = values.astype(np.float32)
            rounded = single.astype(np.float64)
            near = (np.abs(values - rounded) <= 0.5001 * step) & (np.spacing(np.abs(single)) > 4 * step)
        name_in_tables = "seconds_of_week" if column == "time" else f"{column}_deg"
        rounded_columns[name_in_tables] = np.where(near, rounded, values)
    refuse_float32(rounded_columns, name)


@np.errstate(all="ignore")  # damaged numbers are counted, without numpy's warnings
def _chunk(columns: Columns, layout: ExportLayout, order: TimeOrder, latency_s: float, dropped: Counter[str]) -> Chunk:
    """Return the possible rows of a block as poses, with their sigmas; count the other rows in ``dropped``."""
    angles = {f"{name}_rad": np.radians(columns[name]) for name in (*POSITION, "roll", "pitch")}
    height = columns["h-ell"] if "h-ell" in columns else columns["h-msl"] + columns["undulation"]
    rows = RowFilter({"row": np.arange(len(height)), "height_m": height, **angles}, dropped)
    rows.columns["azimuth_rad"] = np.radians(columns["heading"])
    if "q" in columns:
        rows.columns["q"] = np.nan_to_num(columns["q"], nan=-1.0)
        _keep_quality(rows)
    keep_possible_poses(rows)
    keep_possible_times(rows, columns, layout.clock, layout.time, len(layout.places[layout.time]) == 3)
    rows.columns["t_ns"] = rows["t_ns"] - latency_ns(latency_s)
    order.keep(rows)
    sigma_columns = {
        name: columns[column][rows["row"]] for name, column in SIGMA_COLUMN_NAMES.items() if column in columns
    }
    sigmas = sigma_rows(rows["t_ns"], sigma_columns, dropped)
    return chunk(rows.columns, INS_COLUMNS, dropped, sigmas)


def _keep_quality(rows: RowFilter) -> None:
    """Leave out rows whose Q is worse than WORST_Q, and count them by Q."""
    bad = ~((rows["q"] >= 1) & (rows["q"] <= WORST_Q))
    for quality in np.unique(rows["q"][bad])[:10].tolist():  # damaged files may have many values of Q
        rows.keep(rows["q"] != quality, f"quality Q {quality:g}")
    rows.keep((rows["q"] >= 1) & (rows["q"] <= WORST_Q), "quality Q of another number")
