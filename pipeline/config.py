"""YAML -> frozen, strict models. Unknown keys, wrong types and impossible values are errors that name file and key.

Two files are read: the pool's config (target, thresholds) and the session's (instrument files, mounts, sigmas).
Both keep the units of the contract (degrees, metres); code that computes converts at once to radians.
"""

from itertools import pairwise
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from pipeline.errors import ConfigError
from pipeline.parsing import parse, read_yaml
from pipeline.quantities import (
    Angle,
    BeamWidth,
    Depth,
    Latency,
    Lever,
    Model,
    NotNegative,
    Positive,
    RangeSigma,
    SigmaDeg,
    SigmaM,
    SigmaS,
    SoundSpeed,
)
from pipeline.target_settings import Faces as Faces
from pipeline.target_settings import Letters as Letters
from pipeline.target_settings import Origin as Origin
from pipeline.target_settings import Target as Target


# --- the pool --------------------------------------------------------------------------------------------------------
class AsBuilt(Model):
    """The target as surveyed: faces off their design, and how far the wet ones of a family may stand off besides."""

    faces: dict[str, Annotated[float, Field(ge=-0.05, le=0.05)]] = Field(default_factory=dict)  # m outward, by name
    offset_sigma_m: SigmaM = 0.001
    angle_sigma_deg: SigmaDeg = 0.005


class TargetPlace(Model):
    """Of the target, what reading the files needs: changing a letter must not read them again."""

    origin: Origin
    azimuth_deg: float | None


class Ingest(Model):
    max_gap_s: Positive = 5.0  # a longer gap in INS or soundings ends a pass
    reversal_m: Positive = 1.0  # going back along the track by more than this ends a pass


class Georeference(Model):
    box_margin_m: Annotated[float, Field(ge=1.5, le=20)] = 1.5  # round the target; what lies outside is dropped
    max_ins_interval_s: Annotated[float, Field(gt=0, le=1)] = 0.1  # never interpolate over a longer hole in the INS


class Segment(Model):
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
        """Angle (degrees) and lever arm (m) beyond which no mount found is taken: the coarse one's error may be half as
        large again as it is said to be."""
        return 1.5 * self.search_mount_deg, 1.5 * self.search_mount_m


class FitPlanes(Model):
    min_points: Annotated[int, Field(ge=10)] = 50  # a plane of fewer points is not fitted


class AngleIterate(Model):
    max_iterations: Annotated[int, Field(ge=1, le=1000)] = 50
    step_tolerance_deg: Positive = 1e-6
    angle_tolerance_deg: Positive = 1e-6  # change of the angles between the normals in one step


class Offsets(Model):
    max_iterations: Annotated[int, Field(ge=1, le=10000)] = 500
    step_tolerance_deg: Positive = 1e-7
    step_tolerance_m: Positive = 1e-8
    apply_x_first: bool = True  # Y is taken after X has been applied (an X error shows fully in Y on a 45° face)


Freeable = Literal["mbes_latency", "laser_latency", "sound_speed"]


class Adjust(Model):
    free: tuple[Freeable, ...] = ()  # estimated besides the mount and the surfaces
    max_iterations: Annotated[int, Field(ge=1, le=100)] = 20
    robust_k0: Annotated[float, Field(ge=0.5, le=1000)] = 3.0  # IGG III: full weight below, in sigmas
    robust_k1: Annotated[float, Field(ge=0.5, le=1000)] = 6.0  # no weight above
    moment_s: Annotated[float, Field(ge=0.001, le=1000)] = 0.1  # observations within it share the INS's noise
    test_level: Annotated[float, Field(gt=0, lt=0.5)] = 0.001
    test_tolerance_m: SigmaM = 0.003  # systematic residual per surface and pass that is not held against a session

    @model_validator(mode="after")
    def _ordered(self) -> "Adjust":
        if self.robust_k1 <= self.robust_k0:
            raise ValueError(f"robust_k1 = {self.robust_k1} must be greater than robust_k0 = {self.robust_k0}")
        return self


class LaserFit(Model):
    """What is known where the laser itself is calibrated: of the target, and of the coarse mount."""

    face_sigma_deg: SigmaDeg = 0.02  # each family of faces against the design, about either axis
    face_sigma_m: SigmaM = 0.002  # and along its normal
    plumb_sigma_deg: SigmaDeg = 0.02  # the target as a whole out of plumb
    origin_sigma_m: SigmaM | None = None  # of target.origin, each axis, in the INS's datum; null: not surveyed
    azimuth_sigma_deg: SigmaDeg | None = None  # of target.azimuth_deg; null: not surveyed
    coarse_sigma_deg: SigmaDeg = 0.5  # of each coarse angle, where laser.mount_covariance does not say
    coarse_sigma_m: SigmaM = 0.05
    hold_share: Annotated[float, Field(gt=0, le=1)] = 0.5  # one that comes out no surer than this of coarse is held


class Verdict(Model):
    max_sigma_deg: Positive = 0.05
    max_sigma_m: Positive = 0.005


Calibrated = Literal["mbes", "laser"]
Method = Literal["patent_sequential", "patent_alternating", "adjustment"]


class PoolConfig(Model):
    """configs/<pool>.yaml"""

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
    verdict: Verdict = Verdict()
    result: Method = "adjustment"

    @property
    def target_place(self) -> TargetPlace:
        return TargetPlace(origin=self.target.origin, azimuth_deg=self.target.azimuth_deg)


# --- the session -----------------------------------------------------------------------------------------------------
def _inside(pattern: str) -> str:
    path = PurePosixPath(pattern)
    if not pattern or path.is_absolute() or ".." in path.parts or "\\" in pattern or "\0" in pattern:
        raise ValueError("must be a path or pattern inside the session folder, with / between its parts")
    if any("**" in part and part != "**" for part in path.parts):
        raise ValueError("must have ** only as a whole part between two /")
    return pattern


Pattern = Annotated[str, AfterValidator(_inside)]
Files = Annotated[list[Pattern], Field(min_length=1)]
Heights = Literal["ellipsoidal"] | None
Week = Annotated[int, Field(ge=1000, le=5000)] | None  # GPS week, not modulo 1024 (1000: March 1999)


class Mount(Model):
    """Angles and lever arm of a sensor on the body: R_body_from_sensor = Rz(yaw) Rx(pitch) Ry(roll)."""

    roll_deg: Angle
    pitch_deg: Angle
    yaw_deg: Angle
    x_m: Lever
    y_m: Lever
    z_m: Lever


def _covariance(rows: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
    matrix = np.array(rows)
    sigma = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    size = np.outer(sigma, sigma)
    if np.any(np.abs(matrix - matrix.T) > 1e-6 * size) or np.any(np.abs(matrix) > (1 + 1e-6) * size):
        raise ValueError("must be symmetric, with no covariance above the product of its two sigmas")
    scale = np.where(sigma > 0, sigma, 1.0)
    if np.linalg.eigvalsh(matrix / np.outer(scale, scale))[0] < -1e-6:
        raise ValueError("must be positive semidefinite, as a covariance is")
    return rows


Entry = Annotated[float, Field(ge=-100, le=100)]
Covariance = Annotated[  # of (ε about body x, y, z; lever arm x, y, z), R_true = Exp(ε) R: rad and m
    tuple[Annotated[tuple[Entry, ...], Field(min_length=6, max_length=6)], ...],
    Field(min_length=6, max_length=6),
    AfterValidator(_covariance),
]


class MountOrigin(Model):
    """Where a mount comes from: what poolcal has written beside it."""

    method: Literal["coarse", "fine"]
    file: Annotated[str, Field(max_length=300)]
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    date: Annotated[str, Field(pattern="^[0-9]{4}-[0-9]{2}-[0-9]{2}$")]
    software: Annotated[str, Field(max_length=100)]
    held: tuple[Annotated[str, Field(max_length=10)], ...] = ()  # of the six what a fine calibration left as it was


class Drift(Model):
    """First-order Gauss-Markov errors of the INS: standard deviations and correlation time."""

    horizontal_m: SigmaM = 0.015
    vertical_m: SigmaM = 0.02
    roll_pitch_deg: SigmaDeg = 0.01
    heading_deg: SigmaDeg = 0.03
    time_constant_s: Annotated[float, Field(ge=1, le=1e6)] = 200.0


class White(Model):
    """White noise of the INS, per record."""

    position_m: SigmaM = 0.002
    attitude_deg: SigmaDeg = 0.002


INSTRUMENT = "[a-z0-9_]{1,100}"
InstrumentTitle = Annotated[str, Field(min_length=1, max_length=100)]


class InstrumentUsed(Model):
    """A preset as applied; session.yaml has its name alone (pipeline/instruments.py), run.yaml all of this."""

    name: Annotated[str, Field(pattern=f"^{INSTRUMENT}$")]
    title: InstrumentTitle
    unverified: tuple[str, ...]  # keys of the preset that were taken from no document
    origins: dict[str, Literal["session", "preset", "default"]]  # where the sensor's figures come from
    rates: dict[str, int | float | tuple[float, float]]  # for poolcal plan


class Ins(Model):
    instrument: InstrumentUsed | None = None
    files: Files
    format: Literal["novatel", "sbet", "inertial_explorer", "table"]
    accuracy: list[Pattern] = Field(default_factory=list)  # SMRMSG files beside an SBET
    gps_week: Week = None
    latency_s: Latency = 0.0
    drift: Drift = Drift()
    drift_from: Literal["settings", "files"] = "files"  # files: their sigmas, where they tell; else those of drift
    white: White = White()

    @model_validator(mode="before")
    @classmethod
    def _given_drift_goes_first(cls, given: Any) -> Any:
        if isinstance(given, dict) and "drift" in given and "drift_from" not in given:
            return given | {"drift_from": "settings"}
        return given

    @model_validator(mode="after")
    def _accuracy_of_sbet(self) -> "Ins":
        if self.accuracy and self.format != "sbet":
            raise ValueError(f"accuracy files belong to an SBET, but format is {self.format}: take accuracy out")
        return self


class MountSigma(Model):
    """Of each of the three angles and of each component of the lever arm."""

    angle_deg: SigmaDeg = 0.005
    lever_arm_m: SigmaM = 0.0015


class Laser(Model):
    instrument: InstrumentUsed | None = None
    files: Files
    format: Literal["las", "e57", "table"]
    gps_week: Week = None
    frame: Annotated[str, Field(min_length=1, max_length=200)] = "laser"
    heights: Heights = None  # above what, where frame is a CRS that does not say
    mount: Mount
    mount_sigma: MountSigma = MountSigma()  # of the fine calibration
    mount_origin: MountOrigin | None = None
    mount_covariance: Covariance | None = None  # goes before mount_sigma
    range_sigma_m: RangeSigma = 0.005
    range_bias_sigma_m: SigmaM = 0.002  # common to all ranges
    angle_sigma_deg: SigmaDeg = 0.003
    latency_s: Latency = 0.0
    latency_sigma_s: SigmaS = 0.0002

    @model_validator(mode="after")
    def _heights_of_a_crs(self) -> "Laser":
        if self.heights is not None and self.frame == "laser":
            raise ValueError("heights is for points in a CRS, but frame is laser: leave it out, or name the CRS")
        return self


class Mbes(Model):
    instrument: InstrumentUsed | None = None
    files: Files
    format: Literal["r2sonic", "gsf", "kmall", "table"]
    mount: Mount
    mount_origin: MountOrigin | None = None
    mount_covariance: Covariance | None = None  # told, not used: the adjustment starts from the mount alone
    sound_speed_m_s: SoundSpeed | None = None
    svp: Annotated[tuple[tuple[Depth, SoundSpeed], ...], Field(min_length=2, max_length=10_000)] | None = None  # a cast
    sound_speed_sigma_m_s: Annotated[float, Field(ge=0, le=100)] = 0.2
    sound_speed_gradient_sigma_1_s: Annotated[float, Field(ge=0, le=10)] = 0.1  # (m/s)/m: 0.03 °C per metre
    projector_offset_m: tuple[Lever, Lever, Lever] | None = None  # transmitter in the mbes frame; null: as recorded
    range_sigma_m: RangeSigma = 0.008
    range_bias_sigma_m: SigmaM = 0.002  # common to all detections
    angle_sigma_deg: SigmaDeg = 0.06
    beam_deg: tuple[BeamWidth, BeamWidth] = (0.5, 1.0)  # width across track, along track
    latency_s: Latency = 0.0
    latency_sigma_s: SigmaS = 0.0005

    @model_validator(mode="after")
    def _deeper_and_deeper(self) -> "Mbes":
        depths = [depth for depth, _ in self.svp or ()]
        for number, (one, other) in enumerate(pairwise(depths)):
            if other <= one:
                raise ValueError(f"svp has depth {other} after {one}, in row {number + 2}: depths must grow")
        return self


class Recording(Model):
    """Of a sensor, what its readers need: trying another mount or sigma must not read the files again."""

    files: tuple[str, ...]
    accuracy: tuple[str, ...] = ()
    format: str
    gps_week: Week = None
    latency_s: float
    frame: str = "laser"
    heights: Heights = None
    sound_speed_m_s: float | None = None  # of GSF alone, which may have none


class Recordings(Model):
    ins: Recording
    laser: Recording
    mbes: Recording | None


class SessionConfig(Model):
    """SESSION/session.yaml"""

    name: Annotated[str, Field(min_length=1, max_length=300)]  # left out: the session folder's name
    ins: Ins
    laser: Laser
    mbes: Mbes | None = None  # none: only the laser can be calibrated

    @property
    def calibrated(self) -> Calibrated:
        """What is calibrated: the laser, where there is no sonar."""
        return "laser" if self.mbes is None else "mbes"

    @property
    def sonar(self) -> Mbes:
        """The sonar, where one is needed."""
        if self.mbes is None:
            raise ConfigError("session.yaml: mbes is missing: there is no sonar to be calibrated; add its block")
        return self.mbes

    @property
    def recordings(self) -> Recordings:
        def of(sensor: Ins | Laser | Mbes) -> Recording:
            return Recording(
                files=tuple(sensor.files),
                accuracy=tuple(getattr(sensor, "accuracy", ())),
                format=sensor.format,
                gps_week=getattr(sensor, "gps_week", None),
                latency_s=sensor.latency_s,
                frame=getattr(sensor, "frame", "laser"),
                heights=getattr(sensor, "heights", None),
                sound_speed_m_s=getattr(sensor, "sound_speed_m_s", None) if sensor.format == "gsf" else None,
            )

        return Recordings(ins=of(self.ins), laser=of(self.laser), mbes=None if self.mbes is None else of(self.mbes))


# --- reading ---------------------------------------------------------------------------------------------------------
def load_pool(path: Path) -> PoolConfig:
    """The pool's config, checked."""
    return parse(PoolConfig, read_yaml(path), str(path))


def load_session(folder: Path) -> SessionConfig:
    """The session's config, checked."""
    if not folder.is_dir():
        raise ConfigError(f"{folder}: is no folder; SESSION is the folder that holds session.yaml")
    from pipeline.instruments import applied  # here: it is made of the models above

    path = folder / "session.yaml"
    content, own = applied(read_yaml(path), folder)
    ins = content.get("ins")
    if isinstance(ins, dict) and "drift" in ins and "ins.drift" not in own:  # a preset's: what files tell goes first
        content = content | {"ins": {"drift_from": "files"} | ins}
    return parse(SessionConfig, {"name": folder.resolve().name[:300] or "session"} | content, str(path))
