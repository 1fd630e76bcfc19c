"""Inertial Explorer exports, written as its export profiles write them: names and units right-aligned over the rows."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

WEEK, START_S = 2366, 604_790.0  # Saturday 2025-05-17, ten seconds before the GPS week ends, 28 before UTC's day does
LEAP_S = 18
HEADER = """\
Project:     Schwimmbad-M\xfcller
Program:     Inertial Explorer Version 8.90.6611
Profile:     pool
Source:      GNSS/INS Epochs(Smoothed TC Combined)

Datum:       WGS84, (processing datum)
Master 1:    Name BASE, Status ENABLED
             Position -0 30 42.83213, -0 14 24.98087, 12.009 m (WGS84, Ellipsoidal hgt)
UTC Offset:  18 s

"""


@dataclass(frozen=True)
class Row:
    """One truth: GPS seconds since the start of WEEK; degrees and metres."""

    seconds: float
    latitude: float
    longitude: float
    height: float
    roll: float
    pitch: float
    heading: float

    @property
    def week(self) -> int:
        return WEEK + int(self.seconds // 604_800)

    @property
    def of_week(self) -> float:
        return self.seconds - 604_800 * (self.week - WEEK)

    @property
    def utc(self) -> datetime:
        start = datetime(1980, 1, 6, tzinfo=UTC) + timedelta(weeks=WEEK)
        return start + timedelta(milliseconds=round(1000 * self.seconds)) - timedelta(seconds=LEAP_S)


def truth(count: int = 400) -> list[Row]:
    """South and west of zero by less than a degree: -0 in degrees, minutes and seconds. The heading passes 180."""
    return [
        Row(
            START_S + k / 10, -0.5034567891 + 1.7e-7 * k, -0.2512345678 - 2.3e-7 * k, 12.345 + 0.001 * k,
            -1.5 + 0.0101 * k, 0.7 - 0.0053 * k, 178.0 + 0.0107 * k,
        )
        for k in range(count)
    ]  # fmt: skip


def dms(degrees: float) -> str:
    """Sign at the degrees, blanks between: -0 30 12.4444408."""
    total = round(abs(degrees) * 3600, 7)
    minutes, seconds = divmod(total, 60)
    whole, minutes = divmod(int(minutes), 60)
    return f"{'-' if degrees < 0 else ''}{whole} {minutes:02d} {seconds:010.7f}"


Columns = dict[str, tuple[str, Callable[[Row], str]]]  # by name: unit, how it is printed
DEGREES: Columns = {
    "Latitude": ("(deg)", lambda row: f"{row.latitude:.10f}"),
    "Longitude": ("(deg)", lambda row: f"{row.longitude:.10f}"),
}
ATTITUDE: Columns = {
    "Roll": ("(deg)", lambda row: f"{row.roll:.6f}"),
    "Pitch": ("(deg)", lambda row: f"{row.pitch:.6f}"),
    "Heading": ("(deg)", lambda row: f"{row.heading:.6f}"),
}
HEIGHT: Columns = {"H-Ell": ("(m)", lambda row: f"{row.height:.3f}")}
WEEK_SECONDS: Columns = {
    "Week": ("(weeks)", lambda row: f"{row.week}.00000"),
    "GPSTime": ("(sec)", lambda row: f"{row.of_week:.3f}"),
}
QUALITY: Columns = {"Q": ("", lambda row: "1")}
LAYOUTS: dict[str, Columns] = {
    "degrees": {**WEEK_SECONDS, **DEGREES, **HEIGHT, **ATTITUDE, **QUALITY},
    "sixtieths": {
        "Heading": ("(deg)", lambda row: f"{(row.heading + 180) % 360 - 180:.6f}"),
        "VelBdyX": ("(m/s)", lambda row: "-0.004"),
        "AmbStatus": ("", lambda row: "Fixed"),
        **HEIGHT,
        "GPSTime": WEEK_SECONDS["GPSTime"],
        "Longitude": ("(+/-D M S)", lambda row: dms(row.longitude)),
        "Roll": ATTITUDE["Roll"],
        "Latitude": ("(+/-D M S)", lambda row: dms(row.latitude)),
        "PDOP": ("(dop)", lambda row: "1.73"),
        **QUALITY,
        "NS": ("", lambda row: "17"),
        "Pitch": ATTITUDE["Pitch"],
        "Week": WEEK_SECONDS["Week"],
    },
    "utc": {
        "UTCDate": ("(MDY)", lambda row: f"{row.utc.month}/{row.utc.day:02d}/{row.utc.year}"),
        "UTCTime": ("(HMS)", lambda row: f"{row.utc:%H:%M:%S}.{row.utc.microsecond // 1000:03d}"),
        **DEGREES, **HEIGHT,
        "SDNorth": ("(m)", lambda row: "0.012"), "SDEast": ("(m)", lambda row: "0.016"),
        "SDHeight": ("(m)", lambda row: "0.025"),
        **ATTITUDE,
        "RollSD": ("(arcmin)", lambda row: "0.36"), "PitchSD": ("(arcmin)", lambda row: "0.48"),
        "HdngSD": ("(arcmin)", lambda row: "1.8"),
        **QUALITY,
    },
    "commas": {
        "GPSTime": WEEK_SECONDS["GPSTime"],
        "H-MSL": ("(m)", lambda row: f"{row.height + 31.5:.3f}"),
        "Undulation": ("(m)", lambda row: "-31.500"),
        **ATTITUDE, **DEGREES,
    },
}  # fmt: skip


def export(
    columns: Columns, rows: Iterable[Row], commas: bool = False, units: bool = True, header: str = HEADER
) -> bytes:
    """The whole file."""
    printed = [[show(row) for _, show in columns.values()] for row in rows]
    heads = [list(columns), *([[unit for unit, _ in columns.values()]] if units else [])]
    if commas:
        return (header + "".join(",".join(line) + "\n" for line in [*heads, *printed])).encode("latin-1")
    widths = [max(map(len, column)) + 2 for column in zip(*heads, *printed, strict=True)]
    lines = [*heads, *printed]
    padded = ("".join(f"{word:>{width}}" for word, width in zip(line, widths, strict=True)) for line in lines)
    return (header + "".join(line + "\n" for line in padded)).encode("latin-1")


def whole(layout: str, rows: Iterable[Row] | None = None) -> bytes:
    return export(LAYOUTS[layout], truth() if rows is None else rows, commas=layout == "commas")
