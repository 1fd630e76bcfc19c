"""The columns of a sensor's table: needed names, optional names, and the header line of a CSV file.

:mod:`pipeline.readers.table` says what each column means.
"""

from typing import Literal

from pipeline.errors import RawDataError

TableSensor = Literal["ins", "laser", "mbes"]
INS_TABLE_COLUMNS = ("latitude_deg", "longitude_deg", "height_m", "roll_deg", "pitch_deg", "heading_deg")
MBES_TABLE_COLUMNS = ("ping", "beam", "angle_deg", "sound_speed_m_s")
WHOLE_NUMBERS = ("gps_ns", "gps_week", "ping", "beam")
FLOAT64_ONLY = ("gps_ns", "seconds_of_week", "latitude_deg", "longitude_deg")  # refused as float32
_TIME_ALTERNATIVES = (("gps_ns",), ("gps_week", "seconds_of_week"))
_NEEDED = {  # by sensor: alternative sets of columns, beside the time
    "ins": (INS_TABLE_COLUMNS,),
    "laser": (("x_m", "y_m", "z_m"),),
    "mbes": ((*MBES_TABLE_COLUMNS, "two_way_time_s"), (*MBES_TABLE_COLUMNS, "range_m")),
}
_OPTIONAL: dict[str, tuple[str, ...]] = {"ins": (), "laser": (), "mbes": ("transmit_tilt_deg",)}
_KNOWN = frozenset(
    name
    for group in (*_TIME_ALTERNATIVES, *_NEEDED["ins"], *_NEEDED["laser"], *_NEEDED["mbes"])
    for name in group
)
_SEPARATORS = (",", ";", "\t")


def csv_header(line: str) -> tuple[str, list[str]] | None:
    """Return separator and column names from a CSV file's header line; None without two names, one of them known."""
    for separator in _SEPARATORS:
        names = [name.strip().strip('"').lower() for name in line.strip().split(separator)]
        if _KNOWN.intersection(names) and (len(names) > 1):
            return separator, names
    return None


def choose_columns(names: list[str], name: str, sensor: TableSensor) -> list[str]:
    """Choose the columns to read.

    Parameters
    ----------
    names : list of str
        All columns of the file.
    name : str
        The file's path in the session folder, for messages.
    sensor : TableSensor
        The sensor of the table.

    Raises
    ------
    RawDataError
        A needed column is missing, or a column to read stands twice.
    """
    chosen: list[str] = []
    for alternatives in (_TIME_ALTERNATIVES, _NEEDED[sensor]):
        complete = next((group for group in alternatives if set(group) <= set(names)), None)
        if complete is None:
            nearest = max(alternatives, key=lambda group: len(set(group) & set(names)))
            missing = ", ".join(column for column in nearest if column not in names)
            raise RawDataError(f"{name}: has no column {missing} (has: {', '.join(names)[:200]}); add it")
        chosen += complete
    chosen += [column for column in _OPTIONAL[sensor] if column in names]
    twice = [column for column in chosen if names.count(column) > 1]
    if twice:
        raise RawDataError(f"{name}: has column {twice[0]} twice; take one out")
    return chosen
