"""GPS weeks of files whose times are seconds of the week without the week's number."""

from collections.abc import Mapping

from pipeline.config.instruments import Sensor
from pipeline.errors import ConfigError
from pipeline.gps_time import WEEK_S


def gps_weeks(first_s: Mapping[str, float], gps_week: int | None, sensor: Sensor) -> dict[str, int]:
    """Return the GPS weeks in which files begin, by file name; empty without files.

    Parameters
    ----------
    first_s
        Seconds of week of each file's first record, by the file's name.
    gps_week
        Week in which the first file begins, from session.yaml. Every other file gets the week that brings its beginning
        nearest to that of the first file.
    sensor
        The sensor, for the message.

    Raises
    ------
    ConfigError
        There are files, but session.yaml has no week.
    """
    if not first_s:
        return {}
    first_name, reference_s = next(iter(first_s.items()))
    if gps_week is None:
        raise ConfigError(
            f"session.yaml: {sensor}.gps_week is missing: {first_name} has seconds of week alone; "
            f"give {sensor}.gps_week, the GPS week in which the file begins"
        )
    steps = {name: (reference_s - seconds) / WEEK_S for name, seconds in first_s.items()}
    return {name: gps_week + (round(step) if abs(step) <= 1 else 0) for name, step in steps.items()}
