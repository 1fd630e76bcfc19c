"""The pool's config: the target, and a block of thresholds for each stage.

Settings keep the units of the contract (degrees, metres); code that computes converts at once to radians. Unknown
keys, wrong types and impossible values are errors that name file and key.
"""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from pipeline.config.quantities import Model, NotNegative, Positive, SigmaDeg, SigmaM
from pipeline.config.target import Origin, Target


class AsBuilt(Model):
    """The target as surveyed: faces off their design, and how far the wet ones of a family may stand off besides."""

    faces: dict[str, Annotated[float, Field(ge=-0.05, le=0.05)]] = Field(default_factory=dict)  # m outward, by name
    offset_sigma_m: SigmaM = 0.001
    angle_sigma_deg: SigmaDeg = 0.005


class TargetPlace(Model):
    """What reading the files needs of the target: changing a letter must not read them again."""

    origin: Origin
    azimuth_deg: float | None


class Ingest(Model):
    """What ends a pass."""

    max_gap_s: Positive = 5.0  # a longer gap in INS or soundings ends a pass
    reversal_m: Positive = 1.0  # going back along the track by more than this ends a pass


class Georeference(Model):
    """How far round the target points are kept, and how far apart INS records may be."""

    box_margin_m: Annotated[float, Field(ge=1.5, le=20)] = 1.5  # round the target; what lies outside is dropped
    max_ins_interval_s: Annotated[float, Field(gt=0, le=1)] = 0.1  # never interpolate over a longer hole in the INS


class Segment(Model):
    """How the target and the coarse mounts are searched for, and which points get a label."""

    margin_m: NotNegative = 0.03  # to a face's edges, beyond the footprint's half extent
    gate_m: Positive = 0.05  # smallest gate round a face; widened to five times the robust scale
    water_margin_m: NotNegative = 0.10  # no point nearer than this to the water line is used
    min_grazing_deg: Annotated[float, Field(ge=0, lt=90)] = 5.0  # flatter rays are not used
    search_horizontal_m: Positive = 0.5  # how wrong the configured origin may be
    search_vertical_e: Annotated[float, Field(gt=0, le=0.5)] = 0.4  # the same vertically, as a share of e
    search_azimuth_deg: Annotated[float, Field(gt=0, le=20)] = 3.0  # how wrong the configured azimuth may be
    search_mount_deg: Annotated[float, Field(gt=0, le=5)] = 3.0  # how wrong the coarse mount's angles may be
    search_mount_m: Annotated[float, Field(gt=0, le=0.5)] = 0.3  # how wrong its lever arm may be, each axis
    search_laser_deg: Annotated[float, Field(gt=0, le=2)] = 0.5  # the laser's angles, where it is calibrated
    ambiguity_share: Annotated[float, Field(gt=0, lt=1)] = 0.3  # of the wall that a pose half a period off must lose
    ambiguity_margin: Annotated[float, Field(gt=0, lt=1)] = (
        0.02  # another mount that explains so nearly as many soundings
    )

    @property
    def farthest_mount(self) -> tuple[float, float]:
        """Angle (degrees) and lever arm (m) from the coarse mount beyond which no mount is taken.

        The coarse mount's error may be half as large again as it is said to be.
        """
        return 1.5 * self.search_mount_deg, 1.5 * self.search_mount_m


class FitPlanes(Model):
    """Which planes are fitted."""

    min_points: Annotated[int, Field(ge=10)] = 50  # a plane of fewer points is not fitted


class AngleIterate(Model):
    """When the patent's iteration of angles ends."""

    max_iterations: Annotated[int, Field(ge=1, le=1000)] = 50
    step_tolerance_deg: Positive = 1e-6
    angle_tolerance_deg: Positive = 1e-6  # change of the angles between the normals in one step


class Offsets(Model):
    """How the patent's offsets are found, and when their iteration ends."""

    max_iterations: Annotated[int, Field(ge=1, le=10000)] = 500
    step_tolerance_deg: Positive = 1e-7
    step_tolerance_m: Positive = 1e-8
    apply_x_first: bool = True  # Y is taken after X has been applied (an X error shows fully in Y on a 45° face)


Freeable = Literal["mbes_latency", "laser_latency", "sound_speed"]


class Adjust(Model):
    """What the adjustment estimates, and how it weights and tests."""

    free: tuple[Freeable, ...] = ()  # estimated besides the mount and the surfaces
    max_iterations: Annotated[int, Field(ge=1, le=100)] = 20
    robust_k0: Annotated[float, Field(ge=0.5, le=1000)] = 3.0  # IGG III: full weight below, in sigmas
    robust_k1: Annotated[float, Field(ge=0.5, le=1000)] = 6.0  # no weight above
    moment_s: Annotated[float, Field(ge=0.001, le=1000)] = 0.1  # observations within it share the INS's noise
    test_level: Annotated[float, Field(gt=0, lt=0.5)] = 0.001
    test_tolerance_m: SigmaM = 0.003  # largest mean residual, step or difference of passes that is accepted

    @model_validator(mode="after")
    def _ordered(self) -> "Adjust":
        if self.robust_k1 <= self.robust_k0:
            raise ValueError(f"robust_k1 = {self.robust_k1} must be greater than robust_k0 = {self.robust_k0}")
        return self


class LaserFit(Model):
    """Prior information for the calibration of the laser itself: on the target and on its coarse mount."""

    face_sigma_deg: SigmaDeg = 0.02  # each family of faces against the design, about either axis
    face_sigma_m: SigmaM = 0.002  # and along its normal
    plumb_sigma_deg: SigmaDeg = 0.02  # the target as a whole out of plumb
    origin_sigma_m: SigmaM | None = None  # of target.origin, each axis, in the INS's datum; null: not surveyed
    azimuth_sigma_deg: SigmaDeg | None = None  # of target.azimuth_deg; null: not surveyed
    coarse_sigma_deg: SigmaDeg = 0.5  # of each coarse angle, where laser.mount_covariance does not say
    coarse_sigma_m: SigmaM = 0.05
    hold_share: Annotated[float, Field(gt=0, le=1)] = 0.5  # fixed if its sigma exceeds this share of the coarse one


class VerdictLimits(Model):
    """The largest total sigmas of an accepted calibration."""

    max_sigma_deg: Positive = 0.05
    max_sigma_m: Positive = 0.005


Method = Literal["patent_sequential", "patent_alternating", "adjustment"]


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

    @property
    def target_place(self) -> TargetPlace:
        """What reading the files needs of the target."""
        return TargetPlace(origin=self.target.origin, azimuth_deg=self.target.azimuth_deg)
