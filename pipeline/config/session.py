"""The session's config: instrument files, mounts, sigmas."""

from itertools import pairwise
from pathlib import PurePosixPath
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from pipeline.config.mount import Covariance, Mount, MountOrigin, MountSigma
from pipeline.config.quantities import (
    BeamWidth,
    Depth,
    Latency,
    Lever,
    Model,
    RangeSigma,
    SigmaDeg,
    SigmaM,
    SigmaS,
    SoundSpeed,
)
from pipeline.config.resolved import CastUsed, InstrumentUsed
from pipeline.errors import ConfigError

Calibrated = Literal["mbes", "laser"]


def inside(pattern: str) -> str:
    path = PurePosixPath(pattern)
    if not pattern or path.is_absolute() or ".." in path.parts or "\\" in pattern or "\0" in pattern:
        raise ValueError("must be a path or pattern inside the session folder, with / between its parts")
    if any("**" in part and part != "**" for part in path.parts):
        raise ValueError("must have ** only as a whole part between two /")
    if path.parts.count("**") > 2 or len(pattern) > 300:  # each more takes several times as long to search
        raise ValueError("must have ** twice at most, and no more than 300 letters")
    return pattern


Pattern = Annotated[str, AfterValidator(inside)]
Files = Annotated[list[Pattern], Field(min_length=1)]
Heights = Literal["ellipsoidal"] | None
LasTime = Literal["adjusted_standard", "seconds_of_week"] | None
MaxRecords = Annotated[int, Field(ge=1, le=10**12)] | None  # of one file; null: 16 to each of its bytes


def _whole_week(week: int) -> int:
    if 0 <= week < FIRST_WEEK:
        raise ValueError(
            f"is a GPS week modulo 1024, or before 1999; for files from April 2019 on write {week} + 2048 = "
            f"{week + 2048}, for files of 1999 to 2019 {week} + 1024 = {week + 1024}"
        )
    return week


FIRST_WEEK = 1000  # March 1999
Week = Annotated[int, AfterValidator(_whole_week), Field(ge=0, le=5000)] | None  # GPS week, not modulo 1024


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


class Ins(Model):
    instrument: InstrumentUsed | None = None
    files: Files
    format: Literal["novatel", "sbet", "inertial_explorer", "table"]
    accuracy: list[Pattern] = Field(default_factory=list)  # SMRMSG files beside an SBET
    gps_week: Week = None
    max_records: MaxRecords = None
    latency_s: Latency = 0.0
    drift: Drift = Drift()
    drift_from: Literal["settings", "files"] = "files"  # files: their sigmas, where they tell; else those of drift
    white: White = White()

    @model_validator(mode="after")
    def _given_drift_goes_first(self) -> "Ins":
        if "drift" in self.model_fields_set and "drift_from" not in self.model_fields_set:
            object.__setattr__(self, "drift_from", "settings")  # frozen from here on
        return self

    @model_validator(mode="after")
    def _accuracy_of_sbet(self) -> "Ins":
        if self.accuracy and self.format != "sbet":
            raise ValueError(f"accuracy files belong to an SBET, but format is {self.format}: take accuracy out")
        return self


class Laser(Model):
    instrument: InstrumentUsed | None = None
    files: Files
    format: Literal["las", "e57", "table"]
    gps_week: Week = None
    time: LasTime = None  # what the times of LAS count from, where its header says it wrongly; null: as that says
    max_records: MaxRecords = None
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
    def _time_of_las(self) -> "Laser":
        if self.time is not None and self.format != "las":
            raise ValueError(f"time says what times of LAS count from, but format is {self.format}: take time out")
        return self

    @model_validator(mode="after")
    def _heights_of_a_crs(self) -> "Laser":
        if self.heights is not None and self.frame == "laser":
            raise ValueError("heights is for points in a CRS, but frame is laser: leave it out, or name the CRS")
        return self

    @model_validator(mode="after")
    def _covariance_of_this_mount(self) -> "Laser":
        written = None if self.mount_origin is None else self.mount_origin.mount
        if self.mount_covariance is not None and written not in (None, self.mount):
            raise ValueError(
                "mount is not the one in mount_origin, to which mount_covariance belongs: take mount_origin and "
                "mount_covariance out, or put that mount back"
            )
        return self


class Mbes(Model):
    instrument: InstrumentUsed | None = None
    files: Files
    format: Literal["r2sonic", "gsf", "kmall", "all", "table"]
    max_records: MaxRecords = None
    mount: Mount
    mount_origin: MountOrigin | None = None
    mount_covariance: Covariance | None = None  # told, not used: the adjustment starts from the mount alone
    sound_speed_m_s: SoundSpeed | None = None
    svp: Annotated[tuple[tuple[Depth, SoundSpeed], ...], Field(min_length=2, max_length=10_000)] | None = None  # a cast
    svp_number: Annotated[int, Field(ge=1, le=10_000)] | None = None  # which cast of a file that holds several
    svp_sigma_m_s: Annotated[float, Field(ge=0, le=100)] = 0.05  # of one of its speeds, beside what all share
    svp_from: CastUsed | None = None  # where svp was a file's name
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
    time: LasTime = None
    sound_speed_m_s: float | None = None  # of GSF alone, which may have none
    projector_offset_m: tuple[float, float, float] | None = None  # of Kongsberg's files alone, which tell one too


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
                time=getattr(sensor, "time", None),
                sound_speed_m_s=getattr(sensor, "sound_speed_m_s", None) if sensor.format == "gsf" else None,
                projector_offset_m=(
                    getattr(sensor, "projector_offset_m", None) if sensor.format in ("kmall", "all") else None
                ),
            )

        return Recordings(ins=of(self.ins), laser=of(self.laser), mbes=None if self.mbes is None else of(self.mbes))
