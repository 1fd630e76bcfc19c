"""The pool's config: the target, and a block of thresholds for each stage.

Settings are in degrees and metres; code that computes converts degrees to radians at once. Unknown keys, wrong types
and impossible values are errors that name file and key.
"""

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from pipeline.config.quantities import Model, NotNegative, Positive, SigmaDeg, SigmaM
from pipeline.config.target import Origin, Target
from pipeline.config.verdict import VerdictLimits

FARTHEST = 1.5  # farthest correction of the coarse mount that is accepted, in units of segment.search_mount_...


class AsBuilt(Model):
    """The target as surveyed: offsets of faces from the design, and how far they may still be wrong (sigmas)."""

    faces: dict[str, Annotated[float, Field(ge=-0.05, le=0.05)]] = Field(default_factory=dict)  # m outward, by name
    face_sigma_m: SigmaM = 0.0005  # of each face
    offset_sigma_m: SigmaM = 0.001  # of a family's wet faces against the dry ones
    angle_sigma_deg: SigmaDeg = 0.01
    bow_sigma_m: SigmaM = 0.001
    growth_sigma_m: SigmaM = 0.0  # of a layer of one thickness on all wet faces
    roughness_m: NotNegative = 0.0  # RMS of the wet faces about their planes: for poolcal plan, a run finds its own
    dry_roughness_m: NotNegative = 0.0  # the same of the dry faces
    roughness_length_m: Positive = 0.3  # over which both are alike

    @model_validator(mode="after")
    def _growth_is_not_all(self) -> "AsBuilt":
        if self.growth_sigma_m > 0 and self.offset_sigma_m == 0:
            raise ValueError(
                f"growth_sigma_m = {self.growth_sigma_m} with offset_sigma_m = 0: no layer is equally thick "
                "everywhere; say in offset_sigma_m how far single walls may stand off besides"
            )
        return self


class TargetPlace(Model):
    """Settings of the target that the readers need. A change of its shape does not make them read the files again."""

    origin: Origin
    azimuth_deg: float | None


class Ingest(Model):
    """Limits that end a pass."""

    max_gap_s: Positive = 5.0  # a longer gap in INS or soundings ends a pass
    reversal_m: Positive = 1.0  # going back along the track by more than this ends a pass


class Georeference(Model):
    """Size of the box round the target in which points are kept, and the longest interval between INS records."""

    box_margin_m: Annotated[float, Field(ge=1.5, le=20)] = 1.5  # round the target; points outside are dropped
    max_ins_interval_s: Annotated[float, Field(gt=0, le=1)] = 0.1  # never interpolate over a longer hole in the INS


class Segment(Model):
    """Limits of the searches for the target and the provisional mount, and of labelling."""

    margin_m: NotNegative = 0.015  # to a face's edges, beyond the footprint's half extent
    edge_ramp_m: NotNegative = 0.03  # weights rise from 0 to 1 within it, from these limits inward
    side_lobe_widths: Annotated[float, Field(ge=0.5, le=10)] = 1.0  # no sounding so near an inner corner, beam widths
    gate_m: Positive = 0.05  # smallest gate round a face; widened to five times the noise
    water_margin_m: NotNegative = 0.10  # no point nearer than this to the water line is used
    min_grazing_deg: Annotated[float, Field(ge=0, lt=90)] = 5.0  # flatter rays are not used
    search_horizontal_m: Positive = 0.5  # how wrong the configured origin may be
    search_vertical_e: Annotated[float, Field(gt=0, le=0.5)] = 0.4  # the same vertically, as a share of e
    search_azimuth_deg: Annotated[float, Field(gt=0, le=20)] = 3.0  # how wrong the configured azimuth may be
    search_mount_deg: Annotated[float, Field(gt=0, le=5)] = 3.0  # how wrong the coarse mount's angles may be
    search_mount_m: Annotated[float, Field(gt=0, le=0.5)] = 0.3  # how wrong its lever arm may be, each axis
    search_laser_deg: Annotated[float, Field(gt=0, le=2)] = 0.5  # a third of how wrong the laser's angles may be
    ambiguity_share: Annotated[float, Field(gt=0, lt=1)] = 0.3  # least margin over a rival pose, share of b times e
    ambiguity_margin: Annotated[float, Field(gt=0, lt=1)] = (
        0.02  # the mount is ambiguous if a rival's score is smaller by less than this share
    )

    @property
    def farthest_mount(self) -> tuple[float, float]:
        """Largest angle (degrees) and lever arm (m) of a correction that is accepted.

        The limits allow an error of the coarse mount half as large again as the configured search.
        """
        return FARTHEST * self.search_mount_deg, FARTHEST * self.search_mount_m


class FitPlanes(Model):
    """Limit on the planes that are fitted."""

    min_points: Annotated[int, Field(ge=10)] = 50  # a plane of fewer points is not fitted


class AngleIterate(Model):
    """Limits that end the patent's iteration of angles."""

    max_iterations: Annotated[int, Field(ge=1, le=1000)] = 50
    step_tolerance_deg: Positive = 1e-6
    angle_tolerance_deg: Positive = 1e-6  # change of the angles between the normals in one step
    literal_threshold_deg: Positive = 0.02  # patent_literal ends when the angles themselves are smaller


class Offsets(Model):
    """Options of the patent's offsets, and limits that end their iteration."""

    max_iterations: Annotated[int, Field(ge=1, le=10000)] = 500
    step_tolerance_deg: Positive = 1e-7
    step_tolerance_m: Positive = 1e-8
    apply_x_first: bool = True  # Y is taken after X has been applied (an X error shows fully in Y on a 45° face)


Freeable = Literal[
    "mbes_latency", "laser_latency", "sound_speed", "mbes_incidence", "mbes_level_range", "laser_incidence"
]


class Adjust(Model):
    """Additional unknowns of the adjustment, its weights, and its tests."""

    free: tuple[Freeable, ...] = ()  # unknowns beside the mount, the surfaces and the INS's drift
    max_iterations: Annotated[int, Field(ge=1, le=100)] = 20
    robust_k0: Annotated[float, Field(ge=0.5, le=1000)] = 3.0  # IGG III: full weight below, in sigmas
    robust_k1: Annotated[float, Field(ge=0.5, le=1000)] = 6.0  # IGG III: no weight above, in sigmas
    moment_s: Annotated[float, Field(ge=0.001, le=1000)] = 0.1  # observations within it share the INS's noise
    test_level: Annotated[float, Field(gt=0, lt=0.5)] = 0.001
    test_tolerance_m: SigmaM = 0.003  # smaller mean residuals, steps and differences of passes do not matter

    @model_validator(mode="after")
    def _ordered(self) -> "Adjust":
        if self.robust_k1 <= self.robust_k0:
            raise ValueError(f"robust_k1 = {self.robust_k1} must be greater than robust_k0 = {self.robust_k0}")
        return self


class LaserFit(Model):
    """Prior information for a calibration of the laser itself: sigmas of the target and of the coarse mount."""

    face_sigma_deg: SigmaDeg = 0.02  # each family of faces against the design, about either axis
    face_sigma_m: SigmaM = 0.002  # the same along its normal
    plumb_sigma_deg: SigmaDeg = 0.02  # the target as a whole out of plumb
    origin_sigma_m: SigmaM | None = None  # of target.origin, each axis, in the INS's datum; null: not surveyed
    azimuth_sigma_deg: SigmaDeg | None = None  # of target.azimuth_deg; null: not surveyed
    coarse_sigma_deg: SigmaDeg = 0.5  # of each coarse angle, without laser.mount_covariance
    coarse_sigma_m: SigmaM = 0.05
    hold_share: Annotated[float, Field(gt=0, le=1)] = 0.5  # of its coarse sigma: above, it rests on the coarse mount


Method = Literal["patent_sequential", "patent_alternating", "adjustment"]  # patent_literal is never the result


class PoolConfig(Model):
    """The pool's config: configs/<pool>.yaml."""

    target: Target
    as_built: AsBuilt = AsBuilt()
    ingest: Ingest = Ingest()
    georeference: Georeference = Georeference()
    segment: Segment = Segment()
    fit_planes: FitPlanes = FitPlanes()
    angle_iterate: AngleIterate = AngleIterate()
    offsets: Offsets = Offsets()
    adjust: Adjust = Adjust()
    laser_fit: LaserFit = LaserFit()
    verdict: VerdictLimits = VerdictLimits()
    result: Method = "adjustment"

    @field_validator("result", mode="before")
    @classmethod
    def _not_literal(cls, value: object) -> object:
        if value == "patent_literal":
            raise ValueError("is shown beside the result, and is never the result itself; choose adjustment")
        return value

    @property
    def target_place(self) -> TargetPlace:
        """The settings of the target that the readers need."""
        return TargetPlace(origin=self.target.origin, azimuth_deg=self.target.azimuth_deg)
