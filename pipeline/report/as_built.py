"""The target as the laser finds it, against its design in the pool's config.

In the target frame (x into the wall, z up). With the laser's own planes n · X = d of the upright families over all
passes (the adjusted ones are the sonar's as well: what is wrong there would turn them):

* corner: the angle between the normals of a family and of P2 (or of the first family, where none has that role);
* lean: asin n_z, positive where a face looks up;
* b, where there are P1 to P3: P1 and P3 each meet P2 in a line; b is how far apart the two lines are at z = 0;
* e, where the target repeats: the laser's mean residuals on the horizontal faces, v_k ± s_k at design heights h_k, fall
  on v = v0 + q h if the target is higher by the share q; weighted least squares give e (1 + q), e half the period.

Of the patent's target c has no plane that shows it: the back wall is not the target's.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import laser_planes
from pipeline.maths.target.model import TargetModel

Plane = tuple[NDArray[np.float64], float]  # normal, distance
FLANKS = ("P1", "P3")
WALL = "P2"
ODD_LENGTH_M, ODD_HEIGHT_M, ODD_ANGLE_DEG = 0.01, 0.002, 0.2  # worth a look: more than drift between faces makes
FEWEST_FACES = 3
TINY_M = 1e-5  # no mean is known better


def as_found(planes: pd.DataFrame, patterns: pd.DataFrame, model: TargetModel) -> dict[str, Any]:
    """b_m, e_m, corner_deg and lean_deg by family; None, or left out, where the laser did not see it."""
    laser = laser_planes(planes)
    found = {name: laser.get((ALL_PASSES, name)) for name in _upright(model)}
    seen = {name: (plane.normal, plane.distance_m) for name, plane in found.items() if plane is not None}
    return {
        "b_m": _width(seen),
        "e_m": _e(patterns, model),
        "corner_deg": _corners(seen, reference(found)),
        "lean_deg": {family: float(np.degrees(np.arcsin(n[2]))) for family, (n, _) in seen.items()},
    }


def by_design(model: TargetModel) -> dict[str, Any]:
    """The same as the config has it."""
    planes = _upright(model)
    return {
        "b_m": _width(planes),
        "e_m": None if model.repeats_m is None else model.half_period_m,
        "corner_deg": _corners(planes, reference(planes)),
        "lean_deg": {family: float(np.degrees(np.arcsin(n[2]))) for family, (n, _) in planes.items()},
    }


def _upright(model: TargetModel) -> dict[str, Plane]:
    """Families in one plane that is not level, by design."""
    return {one.name: (one.normal, one.distance_m) for one in model.families if one.one_plane and not one.level}


def _width(planes: Mapping[str, Plane]) -> float | None:
    if WALL not in planes or not all(flank in planes for flank in FLANKS):
        return None
    wall, at = planes[WALL]
    (n1, d1), (n3, d3) = (planes[flank] for flank in FLANKS)
    one, other = (np.linalg.solve(np.array([n[:2], wall[:2]]), np.array([d, at])) for n, d in ((n1, d1), (n3, d3)))
    return float(np.linalg.norm(other - one))


def _corners(planes: Mapping[str, Plane], against: str) -> dict[str, float]:
    """Between each family and ``against``; nothing where that was not seen."""
    if against not in planes:
        return {}
    return {
        family: float(np.degrees(np.arccos(np.clip(n @ planes[against][0], -1, 1))))
        for family, (n, _) in planes.items()
        if family != against
    }


def reference(families: Iterable[str]) -> str:
    """The family that the angles of ``corner_deg`` are counted from: the wall, or the first."""
    names = list(families)
    return WALL if WALL in names else next(iter(names), "")


def titled(family: str) -> str:
    """As the screen and the report name it."""
    return "wall" if family == WALL else family


def _e(patterns: pd.DataFrame, model: TargetModel) -> float | None:
    level = [family for family in model.families if family.level]
    if model.repeats_m is None or not level:
        return None
    rows = patterns[(patterns["by"] == "face") & (patterns["sensor"] == "laser")]
    rows = rows[rows["family"] == max(level, key=lambda family: len(family.faces)).name]
    if len(rows) < FEWEST_FACES:
        return None
    height = np.array([model.faces[int(face)].offset_m for face in rows["low"]])
    sigma = np.hypot(rows["sigma_mean_m"].to_numpy(), TINY_M)
    share = np.polyfit(height, rows["mean_m"].to_numpy(), 1, w=1 / sigma)[0]
    return float(model.half_period_m * (1 + share))


def oddities(found: Mapping[str, Any], design: Mapping[str, Any]) -> list[str]:
    """What differs from the config by more than a target is usually built to; nothing that rejects by itself. (Where
    it stands, and how far out of plumb, the verdict's warnings have from the target's pose.)"""
    words = []
    for letter, least in (("b", ODD_LENGTH_M), ("e", ODD_HEIGHT_M)):
        value, given = found[f"{letter}_m"], design[f"{letter}_m"]
        if value is not None and abs(value - given) > least:
            words.append(f"the laser finds {letter} = {value:.4f} m where the config has {given:g} m: measure it")
    for family, angle in found["corner_deg"].items():
        if abs(angle - design["corner_deg"][family]) > ODD_ANGLE_DEG:
            given = design["corner_deg"][family]
            other = reference(design["lean_deg"])
            words.append(f"the laser finds {angle:.2f}° between {titled(other)} and {family}, by design {given:g}°")
    return words
