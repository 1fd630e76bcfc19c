"""PLAN.yaml: planned passes, and the figures of the instruments that session.yaml does not have."""

from typing import Annotated, Literal

from pydantic import Field

from pipeline.config.quantities import Angle, Length, Lever, Model, TransmitSectors

Rate = Annotated[float, Field(ge=0.1, le=1e7)]
Swing = Annotated[float, Field(ge=0, le=45)]
Sway = Annotated[float, Field(ge=0, le=5)]
WAVE_PERIODS, WAVE_SHARES = (1.0, 0.37), (0.75, 0.25)  # the two waves of a motion: of its period, of its amplitude


class LaserFigures(Model):
    """Rates and field of view of the scanner. Its lines run athwart; angles count from its z axis to its x axis."""

    point_rate_hz: Rate = 20_000.0
    line_rate_hz: Rate = 50.0
    field_deg: tuple[Angle, Angle] = (30.0, 130.0)
    max_range_m: Length = 40.0


class MbesFigures(Model):
    """Rates and sector of the sonar."""

    ping_rate_hz: Annotated[float, Field(ge=0.1, le=200)] = 20.0
    beams: Annotated[int, Field(ge=2, le=2048)] = 256
    sector_deg: Annotated[float, Field(gt=0, le=170)] = 130.0
    max_range_m: Length = 15.0
    sectors: TransmitSectors = ()  # tilts of the transmit fan; none: no tilt


class Unrest(Model):
    """Amplitudes and period of the boat's motion about its track.

    Of each amplitude 3/4 belong to a wave of the motion's period, 1/4 to one of 0.37 of it.
    """

    roll_deg: Swing = 1.0
    pitch_deg: Swing = 0.6
    sway_m: Sway = 0.06
    heave_m: Sway = 0.02
    period_s: Annotated[float, Field(ge=0.5, le=1000)] = 4.5


class Pass(Model):
    """One pass along the wall: toward its +y, with the wall to starboard, or back, with the wall to port."""

    distance_m: Annotated[float, Field(ge=0.5, le=100)]  # distance of the INS from the wall
    course: Literal["along", "back"] = "along"
    speed_m_s: Annotated[float, Field(ge=0.01, le=10)] = 0.4
    heading_swing_deg: Annotated[float, Field(ge=0, le=45)] = 1.5  # amplitude
    half_length_m: Annotated[float, Field(ge=0.1, le=100)] | None = None  # null: to 2 m beyond the target
    middle_m: Annotated[float, Field(ge=-1000, le=1000)] | None = None  # along its y; null: the target's middle

    @property
    def where(self) -> str:
        """The pass in a few words: its distance, whether it leads back, where along the target if that is told."""
        passed = f"{self.distance_m:.1f} m" if self.course == "along" else f"{self.distance_m:.1f} m back"
        return passed if self.middle_m is None else f"{passed} at y = {self.middle_m:g} m"

    def seconds(self, half_length_m: float) -> float:
        """Return the time of the pass in seconds; ``half_length_m`` is used if the pass has none of its own."""
        return 2 * (self.half_length_m or half_length_m) / self.speed_m_s


class Budget(Model):
    """Time for all passes, with the turns between them, and time of one turn."""

    seconds: Annotated[float, Field(gt=0, le=36_000)]
    turn_s: Annotated[float, Field(ge=0, le=3600)] = 60.0


class Plan(Model):
    """PLAN.yaml: the passes to be sailed, and the rates of the instruments."""

    ins_height_m: Lever = 1.3  # height of the INS above the water
    ins_rate_hz: Annotated[float, Field(ge=10, le=1000)] = 200.0
    laser: LaserFigures = LaserFigures()
    mbes: MbesFigures = MbesFigures()
    unrest: Unrest = Unrest()
    passes: Annotated[tuple[Pass, ...], Field(min_length=1, max_length=100)]
    candidates: Annotated[tuple[Pass, ...], Field(max_length=30)] = ()  # passes to choose from within the budget
    budget: Budget | None = None
