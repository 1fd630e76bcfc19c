"""All results on LibAC's rows: placing, planes, spheres, closings with several mounts, the adjustment."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.mount import Mounted
from tools.libac_adjustment import Adjusted, PlanePoints, adjusted_on
from tools.libac_closing import PLANE, SPHERES, Closings, Explanation, closings_with, explanation
from tools.libac_rows import PASSES, Rows, mount_of_libac, mount_of_rows, read_rows
from tools.libac_surfaces import FoundPlane, Sphere, planes_in, sphere_through

Array = NDArray[np.float64]
Key = tuple[str, int]
SCRIPT_DEG, SCRIPT_M = (-0.0759, -2.2592, 0.3156), (-0.185596, 0.037658, 2.419063)  # script104_105_106.m, line 59
REVERSED = {"roll": (-1, 1, 1), "pitch": (1, -1, 1), "heading": (1, 1, -1)}


@dataclass(frozen=True)
class Case:
    """A mount before and after the adjustment to the plane, and the closings with both."""

    words: str
    coarse: Mounted
    adjusted: Adjusted
    before: Closings
    after: Closings
    explanation: Explanation


@dataclass(frozen=True)
class Results:
    """Results on all rows.

    planes: those found with the rows' mount; spheres: with unknown radii; cases: LibAC's mount, the script's;
    placed_apart_m: largest distance of a point as placed by the program from the row's own; reversed_m: the same with
    the sign of an angle of the attitude reversed.
    """

    rows: Mapping[Key, Rows]
    planes: Mapping[Key, Sequence[FoundPlane]]
    spheres: Mapping[Key, Sphere]
    cases: tuple[Case, Case]
    placed_apart_m: float
    reversed_m: Mapping[str, float]

    @property
    def roll_sigmas(self) -> tuple[float, ...]:
        """Return by case the roll of the points alone less LibAC's, in sigmas of the points alone.

        An estimate x with the sigma s, from a prior value x0 with the sigma p and from points, is by the points alone
        x0 + (x - x0) p² / (p² - s²), with the sigma s p / √(p² - s²).
        """
        own = self.cases[0].coarse.settings()["roll_deg"]
        found = []
        for case in self.cases:
            start, adjusted = (mount.settings()["roll_deg"] for mount in (case.coarse, case.adjusted.mount))
            before = case.coarse.sigmas(case.adjusted.coarse)["roll_deg"]
            after = case.adjusted.mount.sigmas(case.adjusted.covariance)["roll_deg"]
            share = before**2 - after**2
            alone, sigma = start + (adjusted - start) * before**2 / share, after * before / np.sqrt(share)
            found.append(float((alone - own) / sigma))
        return tuple(found)


def results_of(folder: Path) -> Results:
    """Return all results from a folder of real files."""
    rows = read_rows(folder)
    own, script = mount_of_rows(list(rows.values())), mount_of_libac(SCRIPT_DEG, SCRIPT_M)
    planes = {key: planes_in(one.in_level(own), one.position_m.mean(axis=0)) for key, one in rows.items()}
    on_plane = [planes[PLANE, number][0].rows for number in PASSES]
    spheres = {key: sphere_through(one.in_level(own)) for key, one in rows.items() if key[0] in SPHERES}
    return Results(
        rows=rows,
        planes=planes,
        spheres=spheres,
        cases=(_case("LibAC's", rows, on_plane, own), _case("the script's", rows, on_plane, script)),
        placed_apart_m=_apart_m(rows, own, (1, 1, 1)),
        reversed_m={name: _apart_m(rows, own, signs) for name, signs in REVERSED.items()},
    )


def _case(words: str, rows: Mapping[Key, Rows], on_plane: Sequence[NDArray[np.int64]], mount: Mounted) -> Case:
    passes = [PlanePoints(rows[PLANE, number], chosen) for number, chosen in zip(PASSES, on_plane, strict=True)]
    adjusted = adjusted_on(passes, mount)
    return Case(
        words=words,
        coarse=mount,
        adjusted=adjusted,
        before=closings_with(rows, on_plane, mount),
        after=closings_with(rows, on_plane, adjusted.mount),
        explanation=explanation(rows, on_plane, mount, adjusted.coarse, adjusted.noise.drift),
    )


def _apart_m(rows: Mapping[Key, Rows], mount: Mounted, signs: tuple[int, int, int]) -> float:
    """Return the largest distance of the points as the program places them from the rows' own, with signs of angles."""
    turned = [replace(one, attitude_rad=one.attitude_rad * signs) for one in rows.values()]
    return max(float(np.linalg.norm(one.in_level(mount) - one.placed_m, axis=1).max()) for one in turned)


def neighbours(rows: Rows, found: FoundPlane) -> float:
    """Return the correlation of the distances from the plane of points that follow each other on a line."""
    line = np.searchsorted(rows.line_starts, found.rows, side="right")
    same = np.diff(line) == 0
    return float((found.away_m[1:] * found.away_m[:-1])[same].mean() / np.mean(found.away_m**2))
