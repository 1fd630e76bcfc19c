"""The target's shape as the laser measures it, against its design in the pool's config.

All figures are in the target frame (x into the wall, z up). They come from the planes n · X = d that are fitted to the
laser's points on the upright families, over all passes. (Errors of the sonar would turn the adjusted planes.)

* corner: the angle between the normals of a family and of P2 (or of the first family if none has that role);
* lean: asin n_z, positive if a face looks up;
* b, if there are P1 to P3: P1 and P3 each meet P2 in a line, and b is the distance of these lines at z = 0;
* e, if the target repeats: e is half the period. If the target is higher by the share q, the laser's mean residuals on
  the horizontal faces, v_k ± s_k at design heights h_k, lie on v = v0 + q h. Weighted least squares give e (1 + q).

No plane gives the c of the patent's target, because the back wall (x = c) is not part of the target.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.columns import ALL_PASSES
from pipeline.artefacts.from_tables import laser_planes
from pipeline.maths.target.model import TargetModel
from pipeline.report.reason_codes import ReasonCode, Statement

Plane = tuple[NDArray[np.float64], float]  # normal, distance
FLANKS = ("P1", "P3")
WALL = "P2"
MAX_DEVIATION = {"b": 0.01, "e": 0.002}  # m
MAX_DEVIATION_DEG = 0.2  # of a corner
CERTAIN = 4.0  # standard errors by which b or a corner must differ, too: an INS that drifts turns planes in each pass
MIN_FACES = 3  # smallest number of horizontal faces for e
MIN_SIGMA_M = 1e-5  # smallest sigma of a mean


def measured_shape(planes: pd.DataFrame, patterns: pd.DataFrame, model: TargetModel) -> dict[str, Any]:
    """Return the shape as measured: b_m, e_m, and by family corner_deg and lean_deg.

    A length that the laser did not see is None. A family that it did not see is left out of the angles.

    Parameters
    ----------
    planes : table with the laser's planes
    patterns : table with the laser's mean residuals by face
    model : the target's design
    """
    laser = laser_planes(planes)
    of_family = {name: laser.get((ALL_PASSES, name)) for name in _upright(model)}
    measured = {name: (plane.normal, plane.distance_m) for name, plane in of_family.items() if plane is not None}
    return {
        "b_m": _width(measured),
        "e_m": _half_period(patterns, model),
        "corner_deg": _corners(measured, reference_family(of_family)),
        "lean_deg": _leans(measured),
    }


def shape_errors(planes: pd.DataFrame, model: TargetModel) -> dict[str, float]:
    """Return the standard errors of ``b_m`` and of each family's corner (degrees), from the scatter of the passes.

    What fewer than two passes show is left out.

    Parameters
    ----------
    planes : table with the laser's planes
    model : the target's design
    """
    laser = laser_planes(planes)
    names, shapes = _upright(model), list[dict[str, float | None]]()
    for number in sorted({number for number, _ in laser if number != ALL_PASSES}):
        seen = {name: plane for name in names if (plane := laser.get((number, name))) is not None}
        measured = {name: (plane.normal, plane.distance_m) for name, plane in seen.items()}
        shapes.append({"b_m": _width(measured), **_corners(measured, reference_family(names))})
    errors = pd.DataFrame(shapes, dtype=np.float64).sem().dropna()
    return dict(zip(map(str, errors.index), errors.tolist(), strict=True))


def design_shape(model: TargetModel) -> dict[str, Any]:
    """Return the shape by design, with the keys of ``measured_shape``."""
    planes = _upright(model)
    return {
        "b_m": _width(planes),
        "e_m": None if model.repeats_m is None else model.half_period_m,
        "corner_deg": _corners(planes, reference_family(planes)),
        "lean_deg": _leans(planes),
    }


def _upright(model: TargetModel) -> dict[str, Plane]:
    """Return the designed planes of the families that lie in one plane and are not horizontal."""
    families = [family for family in model.families if family.one_plane and not family.level]
    return {family.name: (family.normal, family.distance_m) for family in families}


def _width(planes: Mapping[str, Plane]) -> float | None:
    """Return b: the distance at z = 0 between the lines in which the flanks meet the wall."""
    if WALL not in planes or not all(flank in planes for flank in FLANKS):
        return None
    n2, d2 = planes[WALL]
    (n1, d1), (n3, d3) = (planes[flank] for flank in FLANKS)
    south, north = (np.linalg.solve(np.array([n[:2], n2[:2]]), np.array([d, d2])) for n, d in ((n1, d1), (n3, d3)))
    return float(np.linalg.norm(north - south))


def _corners(planes: Mapping[str, Plane], reference: str) -> dict[str, float]:
    """Return the angles (degrees) of all families with the ``reference`` family; empty if it was not seen."""
    if reference not in planes:
        return {}
    return {
        family: float(np.degrees(np.arccos(np.clip(n @ planes[reference][0], -1, 1))))
        for family, (n, _) in planes.items()
        if family != reference
    }


def _leans(planes: Mapping[str, Plane]) -> dict[str, float]:
    """Return the lean of each family (degrees), positive if its faces look up."""
    return {family: float(np.degrees(np.arcsin(n[2]))) for family, (n, _) in planes.items()}


def reference_family(families: Iterable[str]) -> str:
    """Return the reference family of ``corner_deg``: the wall, or the first family if there is no wall."""
    names = list(families)
    return WALL if WALL in names else next(iter(names), "")


def family_title(family: str) -> str:
    """Return a family's name as the screen and the report show it."""
    return "wall" if family == WALL else family


def _half_period(patterns: pd.DataFrame, model: TargetModel) -> float | None:
    """Return e: the designed one times (1 + slope of the laser's residuals over the height); None if unknown."""
    level = [family for family in model.families if family.level]
    if model.repeats_m is None or not level:
        return None
    rows = patterns[(patterns["by"] == "face") & (patterns["sensor"] == "laser")]
    rows = rows[rows["family"] == max(level, key=lambda family: len(family.faces)).name]
    if len(rows) < MIN_FACES:
        return None
    height = np.array([model.faces[int(face)].offset_m for face in rows["low"]])
    sigma = np.hypot(rows["sigma_mean_m"].to_numpy(), MIN_SIGMA_M)
    share = np.polyfit(height, rows["mean_m"].to_numpy(), 1, w=1 / sigma)[0]
    return float(model.half_period_m * (1 + share))


def deviations_from_design(
    measured: Mapping[str, Any], design: Mapping[str, Any], errors: Mapping[str, float]
) -> Iterator[Statement]:
    """Yield a warning for each length and corner that differs from the design by more than limit and standard errors.

    The place of the target and its tilt have a separate warning (``target_off_origin``).

    Parameters
    ----------
    measured : the shape, from :func:`measured_shape`
    design : the shape, from :func:`design_shape`
    errors : standard errors, from :func:`shape_errors`
    """
    for letter, limit_m in MAX_DEVIATION.items():
        value, designed = measured[f"{letter}_m"], design[f"{letter}_m"]
        if value is not None and abs(value - designed) > max(limit_m, CERTAIN * errors.get(f"{letter}_m", 0.0)):
            words = f"the laser finds {letter} = {value:.4f} m where the config has {designed:g} m: measure it"
            yield Statement(ReasonCode.LENGTH_OFF_DESIGN, words)
    reference = family_title(reference_family(design["lean_deg"]))
    for family, angle in measured["corner_deg"].items():
        designed = design["corner_deg"][family]
        if abs(angle - designed) > max(MAX_DEVIATION_DEG, CERTAIN * errors.get(family, 0.0)):
            words = f"the laser finds {angle:.2f}° between {reference} and {family}, by design {designed:g}°"
            yield Statement(ReasonCode.ANGLE_OFF_DESIGN, words)
