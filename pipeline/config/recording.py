"""The settings of a sensor's block that the readers need: its files, and the meaning of their times and frames."""

from pathlib import PurePosixPath
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, Field

from pipeline.config.quantities import Model

FIRST_WEEK = 1000  # March 1999


def inside_session(pattern: str) -> str:
    """Return a path or pattern that stays inside the session folder; raise ValueError if it does not."""
    path = PurePosixPath(pattern)
    if not pattern or path.is_absolute() or ".." in path.parts or "\\" in pattern or "\0" in pattern:
        raise ValueError("must be a path or pattern inside the session folder, with / between its parts")
    if any("**" in part and part != "**" for part in path.parts):
        raise ValueError("must have ** only as a whole part between two /")
    if path.parts.count("**") > 2 or len(pattern) > 300:  # each further ** makes a search several times as long
        raise ValueError("must have ** twice at most, and no more than 300 letters")
    return pattern


def _whole_week(week: int) -> int:
    if 0 <= week < FIRST_WEEK:
        raise ValueError(
            f"is a GPS week modulo 1024, or before 1999; for files from April 2019 on write {week} + 2048 = "
            f"{week + 2048}, for files of 1999 to 2019 {week} + 1024 = {week + 1024}"
        )
    return week


Pattern = Annotated[str, AfterValidator(inside_session)]
Files = Annotated[list[Pattern], Field(min_length=1)]
Heights = Literal["ellipsoidal"] | None
LasTime = Literal["adjusted_standard", "seconds_of_week"] | None
MaxRecords = Annotated[int, Field(ge=1, le=10**12)] | None  # most records of one file; null: 16 per byte
Week = Annotated[int, AfterValidator(_whole_week), Field(ge=0, le=5000)] | None  # GPS week, not modulo 1024


class Recording(Model):
    """Settings that one sensor's readers need. Another mount or sigma must not make them read the files again."""

    files: tuple[str, ...]
    accuracy: tuple[str, ...] = ()
    format: str
    gps_week: Week = None
    latency_s: float
    frame: str = "laser"
    heights: Heights = None
    time: LasTime = None
    sound_speed_m_s: float | None = None  # for GSF alone, whose files may have none
    projector_offset_m: tuple[float, float, float] | None = None  # for Kongsberg alone, whose files have one too


class Recordings(Model):
    """Settings that the readers of all sensors need."""

    ins: Recording
    laser: Recording
    mbes: Recording | None


def recording_of(block: BaseModel) -> Recording:
    """Return the settings of a sensor's block (Ins, Laser, Mbes) that its readers need."""
    values = {name: getattr(block, name) for name in Recording.model_fields if hasattr(block, name)}
    values |= {name: tuple(values.get(name, ())) for name in ("files", "accuracy")}
    if values["format"] != "gsf":
        values["sound_speed_m_s"] = None
    if values["format"] not in ("kmall", "all"):
        values["projector_offset_m"] = None
    return Recording(**values)
