"""Settings of the place of a simulated session: the pool round the target, and the target as it was built."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from pipeline.config.quantities import Angle, Lever, Model, NotNegative, Positive
from pipeline.config.target import FaceName

Metres = Annotated[float, Field(ge=-1, le=1)]


class FaceFault(Model):
    """How some faces differ from the design. ``shift_m`` and ``bow_m`` are along the outward normal (to the boat).

    Each face is turned about its own middle: by the first angle about the vertical, counter-clockwise from above, by
    the second about its horizontal, upper edge toward the boat. A horizontal face is turned about the target's x and y
    axes, right-handed. The bow is a parabola in height: nothing at the lower and upper end of all these faces' part,
    ``bow_m`` halfway. A wall that filling the pool has pushed back has a negative one.
    """

    faces: Annotated[tuple[FaceName, ...], Field(min_length=1)]  # faces, or of the letters' target P1, P3 or H: all
    part: Literal["whole", "wet", "dry"] = "whole"
    shift_m: Metres = 0.0
    turn_deg: tuple[Angle, Angle] = (0.0, 0.0)
    bow_m: Metres = 0.0


class Box(Model):
    """A box that stands before the target or on its foot: a fender, a ladder's rung, a footing, a moored boat's hull.

    It is given by its lowest and its highest corner in the target frame, and then turned about the vertical through its
    middle, counter-clockwise from above. Both sensors see it; pool.yaml does not know it.
    """

    name: FaceName
    low_m: tuple[Lever, Lever, Lever]
    high_m: tuple[Lever, Lever, Lever]
    turn_deg: Angle = 0.0

    @model_validator(mode="after")
    def _is_a_box(self) -> "Box":
        if not all(low < high for low, high in zip(self.low_m, self.high_m, strict=True)):
            raise ValueError(f"high_m = {list(self.high_m)} must lie above low_m = {list(self.low_m)} on all axes")
        return self


class Surroundings(Model):
    """The pool round the target, and errors of the target's build and of its position in pool.yaml."""

    half_length_m: Annotated[float, Field(gt=0, le=200)] = 15.0  # back wall and floor reach this far along y
    floor_gap_m: NotNegative = 0.3  # the floor lies this much below the target's foot
    back_wall: bool = True  # false: no wall stands behind the target
    wall_above_m: NotNegative = 0.5  # the back wall ends this much above the target's top
    tilt_deg: tuple[Angle, Angle] = (0.0, 0.0)  # the target as built, turned about its x and y axes
    face_faults: Annotated[tuple[FaceFault, ...], Field(max_length=100)] = ()  # pool.yaml does not know them
    boxes: Annotated[tuple[Box, ...], Field(max_length=500)] = ()  # before the target; pool.yaml does not know them
    fouling_m: NotNegative = 0.0  # thickness of what grows on the wet faces, in the mean
    fouling_sigma_m: NotNegative = 0.0  # by which it varies; it is never below zero
    unevenness_m: NotNegative = 0.0  # sigma of the target's faces about their planes
    unevenness_length_m: Positive = 0.5  # over which it, and the fouling, is alike: correlation exp(-d² / 2 length²)
    origin_error_m: tuple[Lever, Lever, Lever] = (0.0, 0.0, 0.0)  # configured minus true, target axes
    azimuth_error_deg: Angle = 0.0  # configured minus true
    give_azimuth: bool = True  # false: pool.yaml leaves azimuth_deg open
