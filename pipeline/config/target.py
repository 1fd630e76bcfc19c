"""The target in a pool's config: the patent's target by its letters, or any other target by its faces."""

import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from pipeline.config.quantities import Angle, Length, Lever, Model
from pipeline.config.water_by_time import WaterByTime


def _name(text: str) -> str:
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,39}", text):
        raise ValueError("must be a name of at most 40 letters a to z, digits, and - _ . within it")
    return text


FaceName = Annotated[str, AfterValidator(_name)]
FaceNames = Annotated[tuple[FaceName, ...], Field(min_length=2)]


class Origin(Model):
    """Origin of the target frame. For the patent's target it is the centre of the wall's front face."""

    latitude_deg: Annotated[float, Field(ge=-90, le=90)]
    longitude_deg: Annotated[float, Field(ge=-180, le=360)]
    height_m: Annotated[float, Field(ge=-1000, le=10000, description="ellipsoidal")]

    @model_validator(mode="before")
    @classmethod
    def _not_interchanged(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        one, other = given.get("latitude_deg"), given.get("longitude_deg")
        if not isinstance(one, (int, float)) or not isinstance(other, (int, float)):
            return given
        if abs(one) > 90 >= abs(other):
            raise ValueError(
                f"latitude_deg = {one:g} is no latitude: is it the longitude? Write latitude_deg: {other:g} and "
                f"longitude_deg: {one:g}"
            )
        return given


class Letters(Model):
    """The patent's target by design: CONVENTIONS.md, "The target"."""

    kind: Literal["letters"] = "letters"
    a: Length
    b: Length
    c: Length
    e: Length
    low_side: Literal["south", "north"] = "south"
    blocks_per_side: Annotated[int, Field(ge=1, le=200)] | None = None
    first_base_m: Lever | None = None
    stagger_m: Annotated[float, Field(ge=0, le=100)] | None = None
    origin: Origin
    azimuth_deg: Angle | None = None
    water_level_m: Lever = 0.0
    water_by_time: WaterByTime | None = None  # null: the level stays

    @model_validator(mode="after")
    def _blocks_fit(self) -> "Letters":
        if self.blocks_per_side is None and self.a < 2 * self.e:
            raise ValueError(f"a = {self.a} leaves no room for one block and gap of e = {self.e}: a must be >= 2 e")
        return self

    @property
    def shape(self) -> str:
        """The settings that define the shape, for messages."""
        return "target.a, b, c, e and low_side"

    @property
    def sides(self) -> str:
        """The setting that distinguishes left from right, for messages."""
        return "target.low_side"


class MaskSettings(Model):
    """A part of a face where no point counts, because a ladder or a fender stands before it.

    along_m: from the face's middle, to the right as the boat sees it; height_m: above the water. One may be left out.
    """

    along_m: tuple[Lever, Lever] | None = None
    height_m: tuple[Lever, Lever] | None = None

    @model_validator(mode="after")
    def _in_order(self) -> "MaskSettings":
        for name, limits in (("along_m", self.along_m), ("height_m", self.height_m)):
            if limits and limits[0] >= limits[1]:
                raise ValueError(f"{name}: [{limits[0]:g}, {limits[1]:g}]: the first must be the smaller one")
        if self.along_m is None and self.height_m is None:
            raise ValueError("needs along_m, height_m, or both; to leave out the whole face, strike it")
        return self


Masks = Annotated[tuple[MaskSettings, ...], Field(max_length=100)]


class FaceSettings(Model):
    """A planar convex polygon: corners in the target frame, counter-clockwise as the sensors see it."""

    corners: Annotated[tuple[tuple[Lever, Lever, Lever], ...], Field(min_length=3, max_length=60)]
    seen: Literal["both", "dry", "wet"] = "both"  # dry: by the laser only; wet: by the sonar only
    role: Literal["P1", "P2", "P3"] | None = None  # in the patent's steps
    masks: Masks = ()  # parts that do not count


RelationKind = Literal["same_plane", "distance", "height", "parallel"]


class RelationSettings(Model):
    """A known relation between faces, of one of four kinds; ``name``: the name of the family that they form."""

    same_plane: FaceNames | None = None
    distance: FaceNames | None = None  # parallel, with the distances that follow from the corners
    height: FaceNames | None = None  # horizontal, with the height differences that follow from the corners
    parallel: FaceNames | None = None  # at an unknown distance
    name: FaceName | None = None

    @model_validator(mode="after")
    def _one(self) -> "RelationSettings":
        if len(self.given) != 1:
            raise ValueError("must have exactly one of same_plane, distance, height, parallel")
        return self

    @property
    def given(self) -> dict[RelationKind, FaceNames]:
        """The names of the faces by the kind of relation, with one entry."""
        kinds: dict[RelationKind, FaceNames | None] = {
            "same_plane": self.same_plane, "distance": self.distance, "height": self.height, "parallel": self.parallel,
        }
        return {kind: names for kind, names in kinds.items() if names is not None}


class Faces(Model):
    """Any target of planar faces."""

    kind: Literal["faces"]
    faces: Annotated[dict[FaceName, FaceSettings], Field(min_length=1, max_length=500)]
    relations: tuple[RelationSettings, ...] = ()
    repeats_m: Length | None = None  # the height after which the shape repeats; null: it does not
    found: bool = False  # by poolcal target, in laser points of the place itself: left and right are not in question
    origin: Origin
    azimuth_deg: Angle | None = None
    water_level_m: Lever = 0.0
    water_by_time: WaterByTime | None = None  # null: the level stays

    @property
    def shape(self) -> str:
        """The settings that define the shape, for messages."""
        return "target.faces"

    @property
    def sides(self) -> str:
        """The setting that distinguishes left from right, for messages."""
        return "the sign of y in target.faces"


def _kind(value: Any) -> str:
    return str(value.get("kind", "letters") if isinstance(value, dict) else getattr(value, "kind", "letters"))


Target = Annotated[
    Annotated[Letters, Tag("letters")] | Annotated[Faces, Tag("faces")], Discriminator(_kind)
]
