"""MARKS.yaml: a total-station survey of marks on bracket and instruments, and their places by the drawings."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from pipeline.config.quantities import PRINTABLE, Model
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError

Name = Annotated[str, Field(min_length=1, max_length=40), PRINTABLE]
Coordinate = Annotated[float, Field(ge=-1e7, le=1e7)]
Sigma = Annotated[float, Field(ge=1e-5, le=1)]
Sigmas = tuple[Sigma, Sigma, Sigma]
Tilt = Annotated[float, Field(ge=-60, le=60)]
TiltSigma = Annotated[float, Field(ge=1e-4, le=10)]


class Mark(Model):
    """A mark: its coordinates (m), and their standard deviations if they differ from those of all marks."""

    at: tuple[Coordinate, Coordinate, Coordinate]
    sigma_m: Sigmas | None = None


class Survey(Model):
    """Total-station coordinates: any origin and heading, right-handed, z up."""

    sigma_m: Sigmas = (0.001, 0.001, 0.001)
    marks: Annotated[dict[Name, Mark], Field(min_length=3, max_length=100)]


class Drawing(Model):
    """Marks in the instrument's own frame."""

    marks: Annotated[dict[Name, Mark], Field(min_length=1, max_length=30)]
    sigma_m: Sigmas = (0.0005, 0.0005, 0.0005)


class Axes(Model):
    """The body axes from two marks and one angle of the INS.

    Either the y axis runs through the marks ``forward`` (aft, forward), and ``roll_deg`` is the INS's roll. Or the x
    axis runs through the marks ``starboard`` (port, starboard), and ``pitch_deg`` is the INS's pitch.
    """

    origin: Name
    forward: tuple[Name, Name] | None = None
    roll_deg: Tilt | None = None
    roll_sigma_deg: TiltSigma = 0.05
    starboard: tuple[Name, Name] | None = None
    pitch_deg: Tilt | None = None
    pitch_sigma_deg: TiltSigma = 0.05

    @model_validator(mode="after")
    def _one_axis(self) -> "Axes":
        given = {name for name in ("forward", "roll_deg", "starboard", "pitch_deg") if getattr(self, name) is not None}
        if given not in ({"forward", "roll_deg"}, {"starboard", "pitch_deg"}):
            raise ValueError("must have forward with roll_deg, or starboard with pitch_deg, and not both")
        pair = self.forward or self.starboard
        if pair is not None and pair[0] == pair[1]:
            raise ValueError(f"must have two marks for the axis, not {pair[0]} twice")
        return self


class Body(Model):
    """Marks in the body frame, or the marks that define its axes."""

    marks: Annotated[dict[Name, Mark], Field(min_length=1, max_length=30)] | None = None
    axes: Axes | None = None
    sigma_m: Sigmas = (0.0005, 0.0005, 0.0005)

    @model_validator(mode="after")
    def _one_of_two(self) -> "Body":
        if (self.marks is None) == (self.axes is None):
            raise ValueError("must have marks, or axes, and not both")
        return self


class Marks(Model):
    """MARKS.yaml: the survey, the body frame, and the drawings of the sensors."""

    survey: Survey
    body: Body
    laser: Drawing | None = None
    mbes: Drawing | None = None
    leave_out: Annotated[tuple[Name, ...], Field(max_length=100)] = ()

    @model_validator(mode="after")
    def _a_sensor(self) -> "Marks":
        if not self.sensors:
            raise ValueError("must have laser or mbes, with the marks of its drawing")
        return self

    @property
    def sensors(self) -> dict[str, Drawing]:
        """The drawings of the sensors that have one."""
        both = {"laser": self.laser, "mbes": self.mbes}
        return {name: drawing for name, drawing in both.items() if drawing is not None}

    @property
    def named(self) -> dict[str, list[str]]:
        """The names of marks that the survey must have, by the key that names them."""
        axes = self.body.axes
        found = {"body.marks": list(self.body.marks or {})}
        if axes is not None:
            pair = "body.axes.forward" if axes.forward else "body.axes.starboard"
            found = {"body.axes.origin": [axes.origin], pair: list(axes.forward or axes.starboard or ())}
        return found | {f"{name}.marks": list(drawing.marks) for name, drawing in self.sensors.items()}


def load_marks(path: Path) -> Marks:
    """Return the marks in a file, checked; raise ConfigError if a value is invalid or a name is not in the survey."""
    content = read_yaml(path)
    for name in ("survey", "body", "laser", "mbes"):
        _spell_out(content.get(name))
    marks = parse(Marks, content, str(path))
    for key, names in marks.named.items():
        for name in names:
            if name not in marks.survey.marks:
                raise ConfigError(f"{path}: {key}: {name} is not in survey.marks; survey it, or take it out here")
            if key.startswith("body.axes") and name in marks.leave_out:
                raise ConfigError(f"{path}: {key}: {name} is in leave_out; name another mark for the axes")
    for name in marks.leave_out:
        if name not in marks.survey.marks:
            raise ConfigError(f"{path}: leave_out: {name} is not in survey.marks; correct the name")
    return marks


def _spell_out(block: Any) -> None:
    """Expand short forms in place: a mark written as [x, y, z], and one sigma for all three axes."""
    inside = block.get("marks") if isinstance(block, dict) else None
    if isinstance(inside, dict):
        for name, mark in inside.items():
            inside[name] = {"at": mark} if isinstance(mark, list) else mark
    for holder in (block, *(inside.values() if isinstance(inside, dict) else ())):
        if isinstance(holder, dict) and isinstance(holder.get("sigma_m"), (int, float)):
            holder["sigma_m"] = [holder["sigma_m"]] * 3
