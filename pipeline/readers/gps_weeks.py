"""The GPS weeks of files that have seconds of week alone."""

from collections.abc import Mapping

from pipeline.config.instruments import Sensor
from pipeline.errors import ConfigError
from pipeline.gps_time import WEEK_S


def gps_weeks(first_s: Mapping[str, float], gps_week: int | None, sensor: Sensor) -> dict[str, int]:
    """Return the GPS week in which each file starts, by the file's name; nothing for no files.

    Parameters
    ----------
    first_s
        Seconds of week of each file's first record, by the file's name.
    gps_week
        The week of the first file, from session.yaml. The other files get the week that puts them nearest to it.
    sensor
        The sensor, for the message.

    Raises
    ------
    ConfigError
        session.yaml gives no week, and there are files.
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
