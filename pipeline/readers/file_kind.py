"""Kinds of files that are recognised by content: the title of each, and its format or the advice to the user."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class FileKind:
    """A kind of file.

    Parameters
    ----------
    title
        The kind's name in messages.
    format
        session.yaml's word for the format; None: files of this kind are not read.
    sensors
        Sensors whose data a file of this kind may hold; empty if it is not read.
    advice
        What the user should do with a file of a kind that is not read.
    advice_by_sensor
        Advice by sensor, if it differs from ``advice``.
    """

    title: str
    format: str | None = None
    sensors: tuple[str, ...] = ()
    advice: str = ""
    advice_by_sensor: Mapping[str, str] = field(default_factory=dict)

    def advice_for(self, sensor: str) -> str:
        """Return the advice for a file that session.yaml lists under this sensor."""
        return self.advice_by_sensor.get(sensor, self.advice)


# --- read ------------------------------------------------------------------------------------------------------------
NOVATEL = FileKind("a NovAtel log", "novatel", ("ins",))
SBET = FileKind("SBET", "sbet", ("ins",))
INERTIAL_EXPLORER = FileKind("an Inertial Explorer export", "inertial_explorer", ("ins",))
LAS = FileKind("LAS or LAZ", "las", ("laser",))
E57 = FileKind("E57", "e57", ("laser",))
GSF = FileKind("GSF", "gsf", ("mbes",))
KMALL = FileKind("Kongsberg .kmall", "kmall", ("mbes",))
KONGSBERG_ALL = FileKind("Kongsberg .all", "all", ("mbes",))
XTF = FileKind("XTF", "r2sonic", ("mbes",))
R2SONIC_PACKETS = FileKind("R2Sonic packets", "r2sonic", ("mbes",))
PARQUET = FileKind("a Parquet table", "table", ("ins", "laser", "mbes"))
CSV = FileKind("a CSV table", "table", ("ins", "laser", "mbes"))

# --- not read; widespread formats of other makers are in unread_formats.py -------------------------------------------
EMPTY_FILE = FileKind("empty", advice="copy it again, or take it out of the list")
SMRMSG = FileKind(
    "an accuracy file (SMRMSG)", advice="give the SBET that belongs to it, and list this one under ins.accuracy"
)
FLOAT32_TEXT = FileKind(
    "a text whose numbers went through float32: times and positions have lost their digits",
    advice="export it again in double precision, as LAS or as a table with the columns that docs/your-files.md names",
)
TEXT = FileKind(
    "a text without the columns of a table",
    advice="name the columns in its first line as docs/your-files.md has them, or export it in a format of the "
    "instrument",
)
TRAJECTORY_TEXT = FileKind(
    "a trajectory as text, of a layout that is not read",
    advice="export it as SBET (POSPac, Qinertia, Delph INS, OxTS and Inertial Explorer have it), or as a table with "
    "the columns that docs/your-files.md names; if it is Inertial Explorer's, export it with its header",
)
UTF16_TEXT = FileKind("a text in UTF-16", advice="save it as UTF-8")
UNKNOWN = FileKind(
    "of no kind that is read",
    advice="export it in one of the formats that docs/your-files.md names; if it should be one of them, copy it again",
)
