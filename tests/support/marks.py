"""A world of marks, surveyed and drawn; poolcal coarse called on it."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pipeline.config.load import load_session
from tests.support.places import Told, poolcal
from tests.support.surveys import World

KEYS = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m")


PLAIN = """\
# 会话 of boat A
name: 水池 a
ins: {files: [ins/*.gps], format: novatel}
laser:
  files: [laser/*.las]
  format: las   # the scanner's
  mount:
    yaw_deg: 40.0      # counter-clockwise
    roll_deg: 0.3

    pitch_deg: -0.2
    x_m: 0.2
    y_m: 5.0e-1
    z_m: +1   # up
  # of the laser: the last
mbes:
  mount: {roll_deg: -48, pitch_deg: 2.0, yaw_deg: -2.8, x_m: 0.38, y_m: 0.12, z_m: -1.0}   # flow, 流
  files: [mbes/*.xtf]
  format: r2sonic
# end
"""


def marks_of(world: World, seed: int | None = 1) -> dict[str, Any]:
    """MARKS of a world, with errors of 1 mm where there is a seed."""
    rng = np.random.default_rng(seed)
    scale = 0.0 if seed is None else 0.0007
    survey = {name: (at + scale * rng.normal(size=3)).round(9).tolist() for name, at in world.survey().items()}
    drawings = {
        frame: {"marks": {name: (at + scale / 2 * rng.normal(size=3)).round(9).tolist() for name, at in marks.items()}}
        for frame, marks in world.drawings().items()
    }
    return {"survey": {"marks": survey}, **drawings}


def run(session: Path, marks: dict[str, Any] | Path, *words: object) -> Told:
    file = marks if isinstance(marks, Path) else session.parent / "marks.yaml"
    if isinstance(marks, dict):
        file.write_text(yaml.safe_dump(marks, sort_keys=False, allow_unicode=True), encoding="utf-8")
    return poolcal("coarse", file, "--session", session, *words)


def mounts_in(session: Path) -> dict[str, list[float]]:
    content = load_session(session)
    return {name: [getattr(getattr(content, name).mount, key) for key in KEYS] for name in ("laser", "mbes")}
