"""Scenarios: the settings of a simulated pool session. The defaults of all keys are "the default scenario"."""

from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from pipeline import CONFIGS
from pipeline.config.mount import Mount
from pipeline.config.quantities import (
    Angle,
    Latency,
    Length,
    Lever,
    Model,
    NotNegative,
    Positive,
    SoundSpeed,
    TransmitSectors,
)
from pipeline.config.session import Drift, White
from pipeline.config.target import Letters, Origin, Target
from pipeline.config.target_mesh import with_mesh
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError

SCENARIOS_FOLDER = CONFIGS / "scenarios"
Share = Annotated[float, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=1, le=20)]
STEEPEST_TILT_DEG = 45.0
_Tilt = Annotated[float, Field(ge=-STEEPEST_TILT_DEG, le=STEEPEST_TILT_DEG)]


def _utc(text: str) -> str:
    instant = datetime.fromisoformat(text)
    if instant.tzinfo is not None or not 2000 <= instant.year < 2070:
        raise ValueError("must be a UTC moment without zone, such as 2026-05-12T08:00:00, from 2000 to 2069")
    return text


class Surroundings(Model):
    """The pool round the target, and errors of the target's build and of its position in pool.yaml."""

    half_length_m: Annotated[float, Field(gt=0, le=200)] = 15.0  # back wall and floor reach this far along y
    floor_gap_m: NotNegative = 0.3  # the floor lies this much below the target's foot
    back_wall: bool = True  # false: no wall stands behind the target
    wall_above_m: NotNegative = 0.5  # the back wall ends this much above the target's top
    tilt_deg: tuple[Angle, Angle] = (0.0, 0.0)  # the target as built, turned about its x and y axes
    origin_error_m: tuple[Lever, Lever, Lever] = (0.0, 0.0, 0.0)  # configured minus true, target axes
    azimuth_error_deg: Angle = 0.0  # configured minus true
    give_azimuth: bool = True  # false: pool.yaml leaves azimuth_deg open


class Wave(Model):
    """The waves of one coordinate: 3/4 of the amplitude at the period, 1/4 at 0.37 of it; phases are random."""

    amplitude: NotNegative
    period_s: Positive


class Motion(Model):
    """The vessel's movement about its track (amplitudes in m and deg)."""

    surge: Wave = Wave(amplitude=0.03, period_s=8.0)
    sway: Wave = Wave(amplitude=0.06, period_s=9.0)
    heave: Wave = Wave(amplitude=0.02, period_s=4.0)
    roll: Wave = Wave(amplitude=1.0, period_s=4.5)
    pitch: Wave = Wave(amplitude=0.6, period_s=3.8)
    heading: Wave = Wave(amplitude=1.5, period_s=12.0)
    roll_offset_deg: Angle = 0.0
    pitch_offset_deg: Angle = 0.0
    heading_offset_deg: Angle = 0.0  # heading minus the target's azimuth


class TrackScenario(Model):
    """Passes along the target, in the direction of its +y axis."""

    distances_m: Annotated[tuple[Length, ...], Field(min_length=1, max_length=100)] = (4.0, 8.0, 5.0, 7.0)  # to wall
    speed_m_s: Annotated[float, Field(gt=0.001, le=20)] = 0.4
    half_length_m: Length | None = None  # from -y to +y of this; null: 2 m beyond the target
    ins_height_m: Lever = 1.3  # height of the INS above the water
    margin_s: Annotated[float, Field(ge=0, le=3600)] = 3.0  # time of the INS's log before and after each pass
    gap_s: Annotated[float, Field(ge=0, le=86400)] = 60.0  # time between passes, without any log
    log_between_passes: bool = False  # all instruments run on while the vessel turns and comes back


class InsScenario(Model):
    """The INS: rate, noise and files."""

    rate_hz: Annotated[float, Field(ge=1, le=1000)] = 200.0
    white: White = White()
    drift: Drift = Drift(horizontal_m=0.0, vertical_m=0.0, roll_pitch_deg=0.0, heading_deg=0.0)
    format: Literal["inspvas", "inspva", "inspvasa", "inspvaa", "sbet"] = "inspvas"  # inspvasa, inspvaa: ASCII
    files: Literal["session", "pass"] = "session"  # one file per session or per pass
    aligning_s: Annotated[float, Field(ge=0, le=3600)] = 5.0  # aligning before the first pass (novatel), 1 Hz


class LaserScenario(Model):
    """The laser scanner: mount, rates, noise and files."""

    mount: Mount = Mount(roll_deg=0.35, pitch_deg=-0.22, yaw_deg=0.41, x_m=0.21, y_m=0.48, z_m=1.10)  # the truth
    coarse_angle_deg: NotNegative = 0.0  # error of each angle in session.yaml, its sign random
    coarse_lever_m: NotNegative = 0.0  # the same of the lever arm
    coarse_error: Mount | None = None  # instead: each parameter's error, session.yaml's minus true
    point_rate_hz: Annotated[float, Field(ge=1, le=1e6)] = 20000.0
    line_rate_hz: Annotated[float, Field(gt=0, le=1000)] = 50.0
    field_deg: tuple[Angle, Angle] = (30.0, 130.0)  # from the scanner's zenith
    max_range_m: Annotated[float, Field(ge=1, le=1000)] = 40.0
    range_sigma_m: NotNegative = 0.005
    angle_sigma_deg: NotNegative = 0.003
    outlier_share: Share = 0.005  # of the rays: they get a random range
    water_return_share: Share = 0.02  # of the rays that meet the water: they give a point up to 0.3 m beyond it
    latency_s: Latency = 0.0  # recorded time = true time + latency
    latency_declared_s: Latency = 0.0
    frame: Literal["laser", "EPSG:4978"] = "laser"  # EPSG:4978: placed in ECEF with the recorded INS
    format: Literal["laz", "las"] = "laz"
    scale_m: Annotated[float, Field(ge=1e-6, le=0.01)] = 1e-4
    time: Literal["adjusted_standard", "week_seconds"] = "adjusted_standard"


class MbesScenario(Model):
    """The sonar: mount, beams, noise, sound speed and files."""

    mount: Mount = Mount(roll_deg=-48.8, pitch_deg=1.2, yaw_deg=-2.0, x_m=0.30, y_m=0.20, z_m=-2.01)  # the truth
    coarse_angle_deg: NotNegative = 0.8  # error of each coarse angle, its sign random
    coarse_lever_m: NotNegative = 0.08  # the same of the coarse lever arm
    coarse_error: Mount | None = None  # instead: each parameter's error, coarse minus true
    ping_rate_hz: Annotated[float, Field(gt=0, le=100)] = 20.0
    beams: Annotated[int, Field(ge=2, le=1024)] = 256
    sector_deg: Annotated[float, Field(gt=0, le=170)] = 130.0
    spacing: Literal["equi_angle", "equidistant"] = "equi_angle"  # section A0 or A2
    sectors: TransmitSectors = ()  # tilts of the transmit fan by receive angle; none: no tilt
    ping_tilts_deg: Annotated[tuple[_Tilt, ...], Field(max_length=16)] = ()  # added to all sectors', in turn by ping
    max_range_m: Annotated[float, Field(ge=1, le=500)] = 15.0
    range_sigma_m: NotNegative = 0.008
    angle_sigma_deg: NotNegative = 0.06
    beam_deg: tuple[Positive, Positive] = (0.5, 1.0)  # across, along track
    point_beams: bool = False  # true: beams without width
    sub_rays: tuple[Count, Count] = (5, 3)  # rays per beam, across and along; odd
    corner_share: Share = 0.3  # of the beams within corner_reach_m of an inner corner: they get its range
    corner_reach_m: NotNegative = 0.1
    outlier_share: Share = 0.02  # of the beams: they get a random range
    surface_share: Share = 0.04  # of the beams above 30° below the horizon: they get the water surface's range
    dropped_ping_share: Share = 0.01
    sound_speed_true_m_s: SoundSpeed = 1500.0
    sound_speed_recorded_m_s: SoundSpeed = 1500.0
    sound_speed_gradient_1_s: Annotated[float, Field(ge=-2, le=2)] = 0.0  # (m/s)/m downward from the head's true speed
    give_true_sound_speed: bool = False  # true: session.yaml has the true one
    projector_offset_m: tuple[Lever, Lever, Lever] = (0.0, 0.0, 0.0)  # transmitter in the mbes frame
    give_projector_offset: bool = False
    latency_s: Latency = 0.0
    latency_declared_s: Latency = 0.0
    format: Literal["xtf", "r2s", "parquet"] = "xtf"  # r2s: packets one after another; parquet: a table, with tilts
    intensity: bool = True  # section I1

    @model_validator(mode="after")
    def _odd(self) -> "MbesScenario":
        if any(count % 2 == 0 for count in self.sub_rays):
            raise ValueError(f"sub_rays = {list(self.sub_rays)} must be odd: the middle one is the beam's axis")
        return self

    @model_validator(mode="after")
    def _tilted(self) -> "MbesScenario":
        if not self.sectors and not self.ping_tilts_deg:
            return self
        if self.format != "parquet":
            raise ValueError(
                f"format = {self.format}: the sonar's own packets hold no transmit tilt, which sectors and "
                "ping_tilts_deg give; write format: parquet"
            )
        tilts = [sector.tilt_deg + tilt_deg for sector in self.sectors for tilt_deg in self.ping_tilts_deg]
        steepest = max(tilts, key=abs, default=0.0)
        if abs(steepest) > STEEPEST_TILT_DEG:
            raise ValueError(f"sectors and ping_tilts_deg add up to {steepest}°: at most 45° is possible")
        return self


class Scenario(Model):
    """A simulated session."""

    name: Annotated[str, Field(min_length=1, max_length=200)] = "default"
    start_utc: Annotated[str, AfterValidator(_utc)] = "2026-05-12T08:00:00"
    declare_sigmas: bool = True  # false: session.yaml has no noise, drift and beam width
    target: Target = Letters(
        a=8.0, b=3.0, c=1.0, e=0.5, azimuth_deg=0.0,
        origin=Origin(latitude_deg=36.0, longitude_deg=120.1, height_m=12.0),
    )
    surroundings: Surroundings = Surroundings()
    track: TrackScenario = TrackScenario()
    motion: Motion = Motion()
    ins: InsScenario = InsScenario()
    laser: LaserScenario = LaserScenario()
    mbes: MbesScenario = MbesScenario()

    @model_validator(mode="after")
    def _can_be(self) -> "Scenario":
        if self.target.azimuth_deg is None:
            raise ValueError("target.azimuth_deg = null: a simulated target stands at some azimuth; give it")
        height_m = self.track.ins_height_m
        if height_m + self.mbes.mount.z_m > -0.2 or height_m + self.laser.mount.z_m < 0.2:
            raise ValueError(
                f"track.ins_height_m = {height_m} puts the sonar {height_m + self.mbes.mount.z_m:.2f} m and the laser "
                f"{height_m + self.laser.mount.z_m:.2f} m above the water: it must be 0.2 m below, and 0.2 m above"
            )
        if 2 * self.half_length_m / self.track.speed_m_s < 1.0:
            raise ValueError(f"track.speed_m_s = {self.track.speed_m_s}: a pass must last a second or more")
        return self

    @property
    def half_length_m(self) -> float:
        """Half the length of a pass, which runs from -y to +y of this; by default 2 m beyond the target."""
        target = self.target
        if isinstance(target, Letters):
            reach_m = target.b / 2 + target.c
        else:
            reach_m = max(abs(y) for face in target.faces.values() for _, y, _ in face.corners)
        return self.track.half_length_m or reach_m + 2.0

    @property
    def azimuth_deg(self) -> float:
        """Azimuth of the target."""
        assert self.target.azimuth_deg is not None  # checked above
        return self.target.azimuth_deg


def load_scenario(path: Path | None) -> Scenario:
    """Read a scenario from YAML; keys that are left out have their defaults.

    Parameters
    ----------
    path : Path or None
        The file; or, if no file has this name, the name of one in configs/scenarios; None: the default scenario.

    Raises
    ------
    ConfigError
        There is no such scenario, or its content is not valid.
    """
    if path is None:
        return Scenario()
    if path.name == str(path) and not path.suffix and not path.is_file():
        names = scenario_names()
        if path.name not in names:
            known = ", ".join(names)
            raise ConfigError(f"--scenario {path}: is neither a file nor the name of a scenario; these are {known}")
        path = SCENARIOS_FOLDER / f"{path.name}.yaml"
    return parse(Scenario, with_mesh(read_yaml(path), path), str(path))


def scenario_names() -> list[str]:
    """Return the names of the scenarios in configs/scenarios."""
    return sorted(path.stem for path in SCENARIOS_FOLDER.glob("*.yaml"))
