"""The signs of the mount as a drawing: the boat from behind, from its side and from above, by the program's own model.

The curved arrows are points that the rotation of a mount turns by a growing angle, so that the drawing cannot say
another sign than the numbers. The boat is a symbol; the lever arm and the way the sonar looks are those of the mount.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from pipeline.language.chosen import translated
from pipeline.maths.geometry.rotations import rotation_from_mount
from pipeline.mount import Mounted
from pipeline.results.pages.mount_tables import POSITIVE
from pipeline.results.pages.rendering import AXIS, INK, QUIET, SONAR

Array = NDArray[np.float64]
LETTERS = "xyz"
REACH = 62.0  # length of the longest part of a lever arm, in units of the drawing; the view is 200 wide and 200 high
RADIUS, TURN_DEG = 82.0, 40.0  # of the curved arrows
LOOK = 30.0  # length of the line along which the sonar looks
PROW = ((-30, 66), (30, 66), (30, -50), (0, -84), (-30, -50))


@dataclass(frozen=True)
class View:
    """A view of the boat: its name, body axes to the right and up, the angle that it shows, and the boat's outline.

    ``begins``: the point, in body axes, that the angle's arrow follows.
    """

    name: str
    right: int
    up: int
    angle: str
    begins: tuple[float, float, float]
    label: tuple[float, float]  # from the arrow's end to the middle of its name, in units of the drawing: right, down
    outline: Sequence[tuple[float, float]]  # in the same units


VIEWS = (
    View("from behind", 0, 2, "roll", (1, 0, 0), (6, 24), ((-46, -16), (46, -16), (34, 24), (-34, 24))),
    View("from starboard", 1, 2, "pitch", (0, 1, 0), (6, -12), ((-66, -16), (84, -16), (64, 24), (-60, 24))),
    View("from above", 0, 1, "yaw", (0, 1, 0), (-14, 22), PROW),
)


def turned(angle: str, degrees: float, point: Array) -> Array:
    """Return a point (3,) of body axes as a mount with one angle alone turns it; ``angle``: roll, pitch or yaw."""
    angles = {name: np.radians(degrees) if name == angle else 0.0 for name in AXIS}
    return np.asarray(rotation_from_mount(angles["roll"], angles["pitch"], angles["yaw"]) @ point)


def sign_drawings(mount: Mounted, sonar: bool) -> list[Mapping[str, str | Markup | list[str]]]:
    """Return three views, each with its picture (SVG) and the words for what stands in it.

    Parameters
    ----------
    mount
        The mount: where the sensor is, and the way it looks.
    sonar
        Whether the sensor is a sonar, which looks along its -z.
    """
    return [
        {
            "name": view.name,
            "angle": f"{view.angle} +: {POSITIVE[view.angle]}",
            "axes": [f"{LETTERS[axis]} +: {POSITIVE[LETTERS[axis]]}" for axis in (view.right, view.up)],
            "svg": _svg(view, mount, sonar),
        }
        for view in VIEWS
    ]


def _svg(view: View, mount: Mounted, sonar: bool) -> Markup:
    colour = AXIS[view.angle]
    scale = REACH / max(1.0, float(np.abs(mount.lever_arm_body_m).max()))
    sensor = _flat(view, scale * mount.lever_arm_body_m)
    shapes = [f'<polygon points="{_points(view.outline)}" fill="#eef1f4" stroke="{QUIET}"/>']
    for axis, beside in ((view.right, (-3, 17)), (view.up, (16, 12))):  # names clear of outlines and curved arrows
        end = _flat(view, 54.0 * np.eye(3)[axis])
        shapes += _arrow([np.zeros(2), end], INK, 1.2)
        shapes.append(_letter(f"{LETTERS[axis]} +", end + beside, INK))
    steps = np.linspace(0.0, TURN_DEG, 21)
    arc = [_flat(view, RADIUS * turned(view.angle, float(degrees), np.array(view.begins))) for degrees in steps]
    shapes += _arrow(arc, colour, 2.4)
    shapes.append(_letter(f"{translated(view.angle)} +", arc[-1] + view.label, colour))
    shapes.append(f'<line {_line(np.zeros(2), sensor)} stroke="{SONAR}" stroke-dasharray="4 3" stroke-width="1.4"/>')
    if sonar:
        look = sensor + _flat(view, LOOK * mount.R_body_from_sensor @ np.array([0.0, 0.0, -1.0]))
        shapes.append(f'<line {_line(sensor, look)} stroke="{SONAR}" stroke-width="2"/>')
    shapes.append(f'<circle cx="0" cy="0" r="4" fill="{INK}"/>')
    place = f'cx="{sensor[0]:.1f}" cy="{sensor[1]:.1f}"'
    shapes.append(f'<circle {place} r="5" fill="#fff" stroke="{SONAR}" stroke-width="2"/>')
    label = translated(f"the boat {view.name}: {view.angle} is positive {POSITIVE[view.angle]}")
    head = f'<svg viewBox="-100 -100 200 200" width="200" height="200" role="img" aria-label="{label}">'
    return Markup(head + "".join(shapes) + "</svg>")  # numbers and this program's words alone


def _flat(view: View, point: Array) -> Array:
    """Return a point (3,) of body axes in the drawing, (2,): to the right and down."""
    return np.array([point[view.right], -point[view.up]])


def _points(points: Sequence[tuple[float, float]] | Sequence[Array]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def _line(start: Array, end: Array) -> str:
    return f'x1="{start[0]:.1f}" y1="{start[1]:.1f}" x2="{end[0]:.1f}" y2="{end[1]:.1f}"'


def _arrow(path: Sequence[Array], colour: str, width: float) -> Iterator[str]:
    """Yield a line through points, and its head."""
    along = path[-1] - path[-2]
    along /= np.linalg.norm(along)
    across, tip = np.array([-along[1], along[0]]), path[-1] + 6.0 * along
    head = [tip, path[-1] - 3.0 * along + 5.0 * across, path[-1] - 3.0 * along - 5.0 * across]
    yield f'<polyline points="{_points(path)}" fill="none" stroke="{colour}" stroke-width="{width}"/>'
    yield f'<polygon points="{_points(head)}" fill="{colour}"/>'


def _letter(text: str, at: Array, colour: str) -> str:
    return f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" font-size="13" fill="{colour}" text-anchor="middle">{text}</text>'
