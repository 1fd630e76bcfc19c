"""Scenarios: the settings of a simulated pool session. The defaults of all keys are "the default scenario"."""

from datetime import datetime
from math import pi
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from pipeline import CONFIGS
from pipeline.config.heads import HEADS, WithHeads
from pipeline.config.quantities import Angle, Length, Lever, Model, NotNegative, Positive
from pipeline.config.target import Letters, Origin, Target
from pipeline.config.target_mesh import with_mesh
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from pipeline.simulation.scenario_ins import InsScenario
from pipeline.simulation.scenario_laser import LaserScenario
from pipeline.simulation.scenario_mbes import MbesScenario
from pipeline.simulation.scenario_surroundings import Surroundings

SCENARIOS_FOLDER = CONFIGS / "scenarios"


def _utc(text: str) -> str:
    instant = datetime.fromisoformat(text)
    if instant.tzinfo is not None or not 2000 <= instant.year < 2070:
        raise ValueError("must be a UTC moment without zone, such as 2026-05-12T08:00:00, from 2000 to 2069")
    return text


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


Course = Literal["along", "back", "circle"]


class TrackScenario(Model):
    """Passes along the target. ``courses`` are taken in turn: toward its +y axis, toward -y, or once round a circle.

    The circle is sailed to starboard. Its centre lies in front of the target, at the pass's distance from it.
    """

    distances_m: Annotated[tuple[Length, ...], Field(min_length=1, max_length=100)] = (4.0, 8.0, 5.0, 7.0)  # to wall
    speed_m_s: Annotated[float, Field(gt=0.001, le=20)] = 0.4
    courses: Annotated[tuple[Course, ...], Field(min_length=1, max_length=100)] = ("along",)
    circle_radius_m: Annotated[float, Field(ge=0.05, le=100)] = 1.0
    half_length_m: Length | None = None  # from -y to +y of this; null: 2 m beyond the target
    ins_height_m: Lever = 1.3  # height of the INS above the water
    margin_s: Annotated[float, Field(ge=0, le=3600)] = 3.0  # time of the INS's log before and after each pass
    gap_s: Annotated[float, Field(ge=0, le=86400)] = 60.0  # time between passes, without any log
    log_between_passes: bool = False  # all instruments run on while the vessel turns and comes back


class Scenario(WithHeads):
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
    mbes_2: MbesScenario | None = None  # further heads: mbes is then a list
    mbes_3: MbesScenario | None = None
    mbes_4: MbesScenario | None = None

    @model_validator(mode="after")
    def _can_be(self) -> "Scenario":
        if self.target.azimuth_deg is None:
            raise ValueError("target.azimuth_deg = null: a simulated target stands at some azimuth; give it")
        height_m = self.track.ins_height_m
        for head in self.heads.values():
            if height_m + head.mount.z_m > -0.2 or height_m + self.laser.mount.z_m < 0.2:
                raise ValueError(
                    f"track.ins_height_m = {height_m} puts the sonar {height_m + head.mount.z_m:.2f} m and the laser "
                    f"{height_m + self.laser.mount.z_m:.2f} m above the water: it must be 0.2 m below, and 0.2 m above"
                )
        ways_m = {"circle": 2 * pi * self.track.circle_radius_m}
        way_m = min(ways_m.get(course, 2 * self.half_length_m) for course in self.track.courses)
        if way_m / self.track.speed_m_s < 1.0:
            raise ValueError(f"track.speed_m_s = {self.track.speed_m_s}: a pass must last a second or more")
        return self

    @model_validator(mode="after")
    def _one_water(self) -> "Scenario":
        for name, head in self.further.items():
            for key in ("sound_speed_true_m_s", "sound_speed_gradient_1_s", "sound_speed_profile"):
                if getattr(head, key) != getattr(self.mbes, key):
                    raise ValueError(f"{name}.{key} is not that of the first head, but all heads are in one water")
        return self

    @property
    def heads(self) -> dict[str, MbesScenario]:
        """The heads of the sonar by name, the first one first."""
        return {name: head for name in HEADS if (head := getattr(self, name)) is not None}

    @property
    def further(self) -> dict[str, MbesScenario]:
        """The heads beside the first, by name."""
        return {name: head for name, head in self.heads.items() if name != HEADS[0]}

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
    scenario = parse(Scenario, with_mesh(read_yaml(path), path), str(path))
    if scenario.target.water_by_time is not None:
        raise ConfigError(f"{path}: target.water_by_time: simulated water stands still; take the key out")
    return scenario


def scenario_names() -> list[str]:
    """Return the names of the scenarios in configs/scenarios."""
    return sorted(path.stem for path in SCENARIOS_FOLDER.glob("*.yaml"))
