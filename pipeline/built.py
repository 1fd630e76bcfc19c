"""The target as the laser finds it, against the letters of the pool's config.

In the target frame (x into the wall, z up). With the laser's own planes n · X = d of P1, P2, P3 over all passes (the
adjusted ones are the sonar's as well: what is wrong there would turn them):

* b: P1 and P3 each meet P2 in a line; b is how far apart the two lines are at z = 0;
* corner: the angle between the normals of P2 and of P1 or P3, 45° by design;
* lean: asin n_z, positive where a face looks up;
* e: the laser's mean residuals on the horizontal faces, v_k ± s_k at design heights h_k, fall on v = v0 + q h if the
  blocks are higher by the share q; weighted least squares give e (1 + q).

c has no plane that shows it: the back wall is not the target's.
"""

from typing import Any

import numpy as np
import pandas as pd

from pipeline import config
from pipeline.fitted import ALL_PASSES, laser_planes

CORNER_DEG = 45.0
FLANKS = ("P1", "P3")
VERTICAL = ("P1", "P2", "P3")
ODD_LENGTH_M, ODD_HEIGHT_M, ODD_ANGLE_DEG = 0.01, 0.002, 0.2  # worth a look: more than drift between faces makes
FEWEST_FACES = 3
TINY_M = 1e-5  # no mean is known better


def as_found(planes: pd.DataFrame, patterns: pd.DataFrame, faces: pd.DataFrame, e_m: float) -> dict[str, Any]:
    """b_m, e_m, corner_deg and lean_deg by family; None, or left out, where the laser did not see it."""
    seen = {
        family: (plane.normal, plane.distance_m)
        for (number, family), plane in laser_planes(planes).items()
        if number == ALL_PASSES and family in VERTICAL
    }
    lines = {}
    for flank in FLANKS:
        if flank in seen and "P2" in seen:
            (n, d), (wall, at) = seen[flank], seen["P2"]
            lines[flank] = float(np.linalg.solve(np.array([n[:2], wall[:2]]), np.array([d, at]))[1])
    return {
        "b_m": abs(lines["P3"] - lines["P1"]) if len(lines) == len(FLANKS) else None,
        "e_m": _e(patterns, faces, e_m),
        "corner_deg": {
            flank: float(np.degrees(np.arccos(np.clip(seen[flank][0] @ seen["P2"][0], -1, 1)))) for flank in lines
        },
        "lean_deg": {family: float(np.degrees(np.arcsin(n[2]))) for family, (n, _) in seen.items()},
    }


def _e(patterns: pd.DataFrame, faces: pd.DataFrame, e_m: float) -> float | None:
    rows = patterns[(patterns["by"] == "face") & (patterns["sensor"] == "laser") & (patterns["family"] == "H")]
    if len(rows) < FEWEST_FACES:
        return None
    face = faces.set_index("face").loc[rows["low"].astype(int)]
    height = (face["distance_m"] * face["normal_z_target_1"]).to_numpy()
    sigma = np.hypot(rows["sigma_mean_m"].to_numpy(), TINY_M)
    share = np.polyfit(height, rows["mean_m"].to_numpy(), 1, w=1 / sigma)[0]
    return float(e_m * (1 + share))


def oddities(found: dict[str, Any], target: config.Target) -> list[str]:
    """What differs from the config by more than a target is usually built to; nothing that rejects by itself. (Where
    it stands, and how far out of plumb, the verdict's warnings have from the target's pose.)"""
    words = []
    for letter, least in (("b", ODD_LENGTH_M), ("e", ODD_HEIGHT_M)):
        value, given = found[f"{letter}_m"], getattr(target, letter)
        if value is not None and abs(value - given) > least:
            words.append(f"the laser finds {letter} = {value:.4f} m where target.{letter} says {given:g} m: measure it")
    for flank, angle in found["corner_deg"].items():
        if abs(angle - CORNER_DEG) > ODD_ANGLE_DEG:
            words.append(f"the laser finds {angle:.2f}° between wall and {flank}, by design {CORNER_DEG:g}°")
    return words
