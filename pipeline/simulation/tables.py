"""Soundings as a table, the only simulated format that holds transmit tilts."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.simulation.ins import Columns

_DEGREES = {"angle_deg": "angle_rad", "transmit_tilt_deg": "transmit_tilt_rad"}
_UNCHANGED = ("ping", "beam", "two_way_time_s", "sound_speed_m_s")


def write_soundings(path: Path, mbes: Columns) -> None:
    """Write a Parquet file, one row per detection.

    Columns: gps_ns, ping, beam, two_way_time_s, sound_speed_m_s, angle_deg (starboard +), transmit_tilt_deg
    (forward +).
    """
    columns = {"gps_ns": mbes["t_ns"]} | {name: mbes[name] for name in _UNCHANGED}
    columns |= {name: np.degrees(mbes[source]) for name, source in _DEGREES.items()}
    arrays = {name: pa.array(np.ascontiguousarray(values)) for name, values in columns.items()}
    pq.write_table(pa.table(arrays), path)
