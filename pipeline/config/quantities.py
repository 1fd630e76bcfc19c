"""Parts of which settings are made: a strict model, printable text, and numbers within plausible bounds."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
SigmaM = Annotated[float, Field(ge=0, le=10)]
SigmaDeg = Annotated[float, Field(ge=0, le=45)]
SigmaS = Annotated[float, Field(ge=0, le=10)]
BeamWidth = Annotated[float, Field(gt=0, le=45)]
Frequency = Annotated[float, Field(ge=1e4, le=1e7)]
RangeSigma = Annotated[float, Field(ge=1e-5, le=10)]
Angle = Annotated[float, Field(ge=-360, le=360)]
Length = Annotated[float, Field(gt=0, le=100)]
Lever = Annotated[float, Field(ge=-100, le=100)]
Depth = Annotated[float, Field(ge=0, le=200)]
SoundSpeed = Annotated[float, Field(ge=1300, le=1700)]
Latency = Annotated[float, Field(ge=-10, le=10)]


def _printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("must have no control characters")
    return text


PRINTABLE = AfterValidator(_printable)


class Model(BaseModel):
    """A block of settings: frozen, strict, without unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    @classmethod
    def prepared(cls, content: Mapping[str, Any], where: str) -> dict[str, Any]:
        """Return a file's content in the form in which this model's fields hold it; ``where``: the file."""
        return dict(content)


class TransmitSector(Model):
    """The tilt (along track, forward +) of the transmit fan for receive angles up to ``to_deg`` (starboard +)."""

    to_deg: Annotated[float, Field(ge=-90, le=90)]
    tilt_deg: Annotated[float, Field(ge=-45, le=45)]


def _in_order(sectors: tuple[TransmitSector, ...]) -> tuple[TransmitSector, ...]:
    edges = [sector.to_deg for sector in sectors]
    if edges and (edges != sorted(set(edges)) or edges[-1] != 90):
        raise ValueError("sectors must stand from port to starboard, the last one with to_deg: 90")
    return sectors


TransmitSectors = Annotated[tuple[TransmitSector, ...], AfterValidator(_in_order)]
