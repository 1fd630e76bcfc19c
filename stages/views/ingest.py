"""Stage ingest: attitude over time, and a table of the raw files."""

from functools import partial
from typing import Any

import numpy as np

from pipeline.artefacts.catalogue.points import FILES, TRAJECTORY
from pipeline.gps_time import NS, unix_ns_from_gps, utc_text
from pipeline.run.results import Tables
from pipeline.text_table import text_table
from stages.views.recording import log_curve, text_document

RECORDS = 20_000  # most records in a curve
HOLE_NS = 2 * NS
AXES = {"roll": (0, 114, 178), "pitch": (230, 159, 0), "heading": (0, 158, 115)}
HOW_TO_READ = """\
These curves run over the timeline 'time', the replay
of the iteration over the timeline 'iteration': choose
between them at the bottom left, beside the play button.

Attitude   roll: starboard down, pitch: bow up,
           heading: from its mean
Points     on the target's faces, of those in the
           table residuals, counted second by second
Residual   mean of a second by family of faces, plus
           towards the boat, of horizontal faces up
"""


def log(recording: Any, tables: Tables) -> None:
    """Log the attitude over time and a table of the raw files."""
    import rerun as rr

    whole = tables.table(TRAJECTORY)
    t_ns = whole["t_ns"].to_numpy()
    trajectory = whole.iloc[:: max(1, -(-len(whole) // RECORDS))]
    after = np.searchsorted(trajectory["t_ns"].to_numpy(), t_ns[1:][np.diff(t_ns) > HOLE_NS])
    broken = np.isin(np.arange(len(trajectory)), after)  # no line across a hole in the log
    heading = np.unwrap(trajectory["azimuth_rad"].to_numpy())
    values = {
        "roll": trajectory["roll_rad"].to_numpy(),
        "pitch": trajectory["pitch_rad"].to_numpy(),
        "heading": heading - heading.mean(),
    }
    for name, angle in values.items():
        style = rr.SeriesLines(colors=AXES[name], names=name)
        shown = np.where(broken, np.nan, np.degrees(angle))
        shown_ns = trajectory["t_ns"].to_numpy()
        log_curve(recording, f"quality/attitude/{name}", style, partial(time_column, shown_ns), shown)
    heads = ("sensor", "records", "left out", "from (UTC)", "rate, Hz", "file")
    rows = [
        (
            row["sensor"],
            f"{row['records']:,}",
            f"{row['dropped']:,}",
            utc_text(int(row["first_ns"])),
            f"{row['rate_hz']:.1f}",
            row["file"],
        )
        for row in tables.table(FILES).to_dict("records")
    ]
    lines = text_table("<8>12>10  <22>10  <4", heads, rows)
    recording.log("tables/files", text_document("\n".join(lines)), static=True)
    recording.log("tables/how_to_read", text_document(HOW_TO_READ), static=True)


def time_column(t_ns: Any) -> Any:
    """Return instants (ns since the GPS epoch) as a column of the timeline ``time``."""
    import rerun as rr

    return rr.TimeColumn("time", timestamp=unix_ns_from_gps(t_ns).astype("datetime64[ns]"))
