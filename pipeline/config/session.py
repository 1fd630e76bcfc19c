"""The session's config: instrument files, mounts, sigmas."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from pipeline.config.about import About, AboutBlock
from pipeline.config.heads import HEADS, WithHeads
from pipeline.config.mount import Covariance, Mount, MountOrigin, MountSigma
from pipeline.config.quantities import (
    BeamWidth,
    Depth,
    Frequency,
    Latency,
    Length,
    Lever,
    Model,
    RangeSigma,
    SigmaDeg,
    SigmaM,
    SigmaS,
    SoundSpeed,
)
from pipeline.config.recording import Files, Heights, LasTime, MaxRecords, Pattern, Recordings, Week, recording_of
from pipeline.config.references import CastUsed, InstrumentUsed
from pipeline.errors import ConfigError

OF_WATER = (  # keys of Mbes that are the same for all heads
    "sound_speed_m_s", "svp", "svp_sigma_m_s", "sound_speed_sigma_m_s", "sound_speed_gradient_sigma_1_s",
)  # fmt: skip
Calibrated = Literal["mbes", "laser"]  # which sensor is calibrated


class Drift(Model):
    """First-order Gauss-Markov errors of the INS: standard deviations and correlation time."""

    horizontal_m: SigmaM = 0.015
    vertical_m: SigmaM = 0.02
    roll_pitch_deg: SigmaDeg = 0.01
    heading_deg: SigmaDeg = 0.03
    time_constant_s: Annotated[float, Field(ge=1, le=1e6)] = 200.0


class DriftWithin(Model):
    """Factors within which the figures of the drift hold (one sigma); 1: they are exact, and the data do not count."""

    sigmas: Annotated[float, Field(ge=1, le=100)] = 2.0
    time_constant: Annotated[float, Field(ge=1, le=100)] = 3.0


class White(Model):
    """White noise of the INS, per record."""

    position_m: SigmaM = 0.002
    attitude_deg: SigmaDeg = 0.002


class Ins(Model):
    """The INS: its files, its clock, its errors."""

    instrument: InstrumentUsed | None = None
    files: Files
    format: Literal["novatel", "sbet", "inertial_explorer", "table"]
    accuracy: list[Pattern] = Field(default_factory=list)  # SMRMSG files beside an SBET
    gps_week: Week = None
    max_records: MaxRecords = None
    latency_s: Latency = 0.0
    drift: Drift = Drift()
    drift_from: Literal["settings", "files"] = "files"  # files: their sigmas, if they hold any; else those of drift
    drift_within: DriftWithin = DriftWithin()
    white: White = White()

    @model_validator(mode="after")
    def _given_drift_goes_first(self) -> "Ins":
        if "drift" in self.model_fields_set and "drift_from" not in self.model_fields_set:
            object.__setattr__(self, "drift_from", "settings")  # the model is frozen
        return self

    @model_validator(mode="after")
    def _accuracy_of_sbet(self) -> "Ins":
        if self.accuracy and self.format != "sbet":
            raise ValueError(f"accuracy files belong to an SBET, but format is {self.format}: take accuracy out")
        return self


class Laser(Model):
    """The laser scanner: its files, its coarse mount, its errors."""

    instrument: InstrumentUsed | None = None
    files: Files
    format: Literal["las", "e57", "table"]
    gps_week: Week = None
    time: LasTime = None  # zero of the times in LAS, if the header has it wrong; null: by the header
    max_records: MaxRecords = None
    frame: Annotated[str, Field(min_length=1, max_length=200)] = "laser"
    heights: Heights = None  # their reference, if frame is a CRS without one
    mount: Mount
    mount_sigma: MountSigma = MountSigma()  # of the fine calibration
    mount_origin: MountOrigin | None = None
    mount_covariance: Covariance | None = None  # takes precedence over mount_sigma
    range_sigma_m: RangeSigma = 0.005
    range_bias_sigma_m: SigmaM = 0.002  # common to all ranges
    incidence_bias_sigma_m: SigmaM = 0.001  # of ranges at 45° incidence against 0°, growing like 1 / cos i - 1
    angle_sigma_deg: SigmaDeg = 0.003
    beam_m: Annotated[float, Field(ge=0, le=0.1)] = 0.01  # diameter of the beam at the target
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
    """The sonar: its files, its coarse mount, sound speed, and errors."""

    instrument: InstrumentUsed | None = None
    files: Files
    format: Literal["r2sonic", "gsf", "kmall", "all", "table"]
    max_records: MaxRecords = None
    mount: Mount
    mount_origin: MountOrigin | None = None
    mount_covariance: Covariance | None = None  # not used: the adjustment starts from the mount alone
    sound_speed_m_s: SoundSpeed | None = None
    svp: Annotated[tuple[tuple[Depth, SoundSpeed], ...], Field(min_length=2, max_length=10_000)] | None = None  # a cast
    svp_number: Annotated[int, Field(ge=1, le=10_000)] | None = None  # which cast of a file that holds several
    svp_sigma_m_s: Annotated[float, Field(ge=0, le=100)] = 0.05  # of each of its speeds, beside their common error
    svp_from: CastUsed | None = None  # if svp was the name of a file
    sound_speed_sigma_m_s: Annotated[float, Field(ge=0, le=100)] = 0.2
    sound_speed_gradient_sigma_1_s: Annotated[float, Field(ge=0, le=10)] = 0.1  # (m/s)/m, as with 0.03 °C per metre
    projector_offset_m: tuple[Lever, Lever, Lever] | None = None  # transmitter in the mbes frame; null: as recorded
    projector_sigma_m: SigmaM = 0.005  # of its place, each axis
    range_sigma_m: RangeSigma = 0.008
    range_bias_sigma_m: SigmaM = 0.005  # common to all detections
    incidence_bias_sigma_m: SigmaM = 0.003  # at 45° incidence against 0°, growing like 1 / cos i - 1
    level_bias_sigma_m: SigmaM = 0.010  # common to all detections on horizontal faces
    angle_sigma_deg: SigmaDeg = 0.06
    beam_deg: tuple[BeamWidth, BeamWidth] = (0.5, 1.0)  # width across track, along track
    frequency_hz: Frequency = 400_000.0  # at which beam_deg holds
    aperture_m: tuple[Length, Length] | None = None  # of the receiver, the transmitter; null: by beam_deg, frequency_hz
    focused: tuple[bool, bool] = (True, False)  # in the near field: reception, transmission
    latency_s: Latency = 0.0
    latency_sigma_s: SigmaS = 0.0005

    @model_validator(mode="after")
    def _deeper_and_deeper(self) -> "Mbes":
        depths = [depth for depth, _ in self.svp or ()]
        for number, (one, other) in enumerate(pairwise(depths)):
            if other <= one:
                raise ValueError(f"svp has depth {other} after {one}, in row {number + 2}: depths must grow")
        return self


class SessionConfig(WithHeads):
    """The session's config: SESSION/session.yaml."""

    name: Annotated[str, Field(min_length=1, max_length=300)]  # default: the session folder's name
    ins: Ins
    laser: Laser
    mbes: Mbes | None = None  # None: the laser is calibrated; of several heads the first
    mbes_2: Mbes | None = None  # further heads: mbes is then a list
    mbes_3: Mbes | None = None
    mbes_4: Mbes | None = None
    about: AboutBlock = About()  # for the certificate alone

    @property
    def calibrated(self) -> Calibrated:
        """The sensor that is calibrated: the sonar, or the laser if there is no sonar."""
        return "laser" if self.mbes is None else "mbes"

    @property
    def sonar(self) -> Mbes:
        """The sonar; raise ConfigError if there is none."""
        if self.mbes is None:
            raise ConfigError("session.yaml: mbes is missing: there is no sonar to be calibrated; add its block")
        return self.mbes

    @property
    def heads(self) -> dict[str, Mbes]:
        """The heads of the sonar by name, the first one first; none if the laser is calibrated."""
        return {name: head for name in HEADS if (head := getattr(self, name)) is not None}

    def alone(self, head: str) -> "SessionConfig":
        """Return the session as if it had this head of the sonar alone."""
        return self.model_copy(update=dict.fromkeys(HEADS[1:]) | {"mbes": self.heads[head]})

    @model_validator(mode="after")
    def _one_water(self) -> "SessionConfig":
        for name, head in list(self.heads.items())[1:]:
            for key in OF_WATER:
                if getattr(head, key) != getattr(self.mbes, key):
                    raise ValueError(
                        f"{name}.{key} is not that of the first head, but all heads are in one water: give all the same"
                    )
        return self

    @property
    def recordings(self) -> Recordings:
        """The settings of the three sensors that the readers need."""
        mbes = None if self.mbes is None else recording_of(self.mbes)
        return Recordings(ins=recording_of(self.ins), laser=recording_of(self.laser), mbes=mbes)
