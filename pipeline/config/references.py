"""What the names in session.yaml refer to, of an instrument and of a cast's file: run.yaml holds all of it."""

from typing import Annotated, Literal

from pydantic import Field

from pipeline.config.quantities import Model

INSTRUMENT = "[a-z0-9_]{1,100}"
InstrumentTitle = Annotated[str, Field(min_length=1, max_length=100)]


class InstrumentUsed(Model):
    """A preset as it was used; session.yaml has its name alone (pipeline/config/instruments.py)."""

    name: Annotated[str, Field(pattern=f"^{INSTRUMENT}$")]
    title: InstrumentTitle
    unverified: tuple[str, ...]  # keys of the preset that were taken from no document
    origins: dict[str, Literal["session", "preset", "default"]]  # where the sensor's figures come from
    rates: dict[str, int | float | tuple[float, float]]  # for poolcal plan


class CastUsed(Model):
    """A cast as it was used; session.yaml has its file's name alone (pipeline/readers/casts.py)."""

    file: Annotated[str, Field(max_length=1000)]  # in the session folder
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    kind: Annotated[str, Field(max_length=50)]
    number: Annotated[int, Field(ge=1)]  # of the cast, in a file with several
    casts: Annotated[int, Field(ge=1)]  # number of casts in the file
    taken: Annotated[str, Field(max_length=50)] | None  # by the file, whose time zone is not known
    place_deg: tuple[float, float] | None  # latitude, longitude
    rows: int
    left_out: dict[str, int]  # by reason
    first_m: float
    last_m: float
    tolerance_m_s: float  # largest distance of the rows, or of their means, from the depths that were kept
    averaged_m: float  # interval of depth over which scattering rows were averaged first; 0: not averaged
    scatter_m_s: float  # of the rows about what was kept, RMS
