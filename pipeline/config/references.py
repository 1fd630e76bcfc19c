"""The presets and casts that session.yaml names. run.yaml holds them in full."""

from typing import Annotated, Literal

from pydantic import Field

from pipeline.config.quantities import Model

INSTRUMENT = "[a-z0-9_]{1,100}"
InstrumentTitle = Annotated[str, Field(min_length=1, max_length=100)]


class InstrumentUsed(Model):
    """The preset that was used; session.yaml has its name alone (pipeline/config/instruments.py)."""

    name: Annotated[str, Field(pattern=f"^{INSTRUMENT}$")]
    title: InstrumentTitle
    unverified: tuple[str, ...]  # keys of the preset that were taken from no document
    origins: dict[str, Literal["session", "preset", "default"]]  # source of each figure of the sensor
    rates: dict[str, int | float | tuple[float, float]]  # for poolcal plan


class CastUsed(Model):
    """The cast that was used; session.yaml has its file's name alone (pipeline/readers/casts.py)."""

    file: Annotated[str, Field(max_length=1000)]  # in the session folder
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    kind: Annotated[str, Field(max_length=50)]
    number: Annotated[int, Field(ge=1)]  # number of the cast in the file
    casts: Annotated[int, Field(ge=1)]  # number of casts in the file
    taken: Annotated[str, Field(max_length=50)] | None  # time by the file, whose time zone is not known
    place_deg: tuple[float, float] | None  # latitude, longitude
    rows: int
    left_out: dict[str, int]  # rows left out, by reason
    first_m: float
    last_m: float
    tolerance_m_s: float  # largest deviation of the rows, or of their means, from the thinned cast
    averaged_m: float  # depth interval over which scattered rows were averaged first; 0: none were
    scatter_m_s: float  # RMS of the rows about the thinned cast
