"""Errors of height with which the sensors' points miss the target.

If both sensors miss it by the same height, target.origin.height_m is wrong. If one sensor misses it, the z of its mount
is wrong, or, for georeferenced laser points, the reference surface of their heights.

The laser sees the target only above the water, the sonar only below it. Therefore points count only on their sensor's
side of the water. A shift downwards loses the laser's lowest points and the sonar's deepest ones. A shift upwards loses
the laser's highest points and the sonar's shallowest ones. If the target repeats with height, these losses at its ends
distinguish one repetition from the next.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.findings import Finding
from pipeline.checking.point_samples import NAMES, PointSample, place_points
from pipeline.checking.track import InsTrack
from pipeline.target.surface import ClosestSurface

Array = NDArray[np.float64]
REACH_M = 0.5  # distance from a face beyond which a point counts 0
AT_ONCE = 200_000  # shifted points in memory
FARTHEST_M, STEP_M = 50.0, 0.25  # largest shift that is tried, and the step between shifts
SHIFTS_M = np.arange(-FARTHEST_M, FARTHEST_M + STEP_M / 2, STEP_M)
HERE = len(SHIFTS_M) // 2  # index of the shift 0
LEAST_M = 0.8  # a smaller shift may be a wrong target.water_level_m; the calibration's search covers part of it
LIKE = 0.97  # share of the best agreement that counts as equally good
TOGETHER = 0.8  # least share of its own best agreement that each sensor must have at the common shift
WORSE = 0.8  # heights are wrong only if the agreement without a shift is a smaller share of the best
FEWEST, FIT = 50, 0.05  # fewest points in good passes, and least agreement at the best shift
SIGN_M = 0.5  # a shift this near to minus twice the mount's z is explained by the sign of z


@dataclass(frozen=True)
class Fit:
    """Agreement of one sensor's points with the target, by the shift upwards.

    Attributes
    ----------
    sensor : str
        ``laser`` or ``mbes``.
    z_m : float
        z of the sensor's mount.
    sided, free : ndarray, shape (k,)
        Agreement at each of SHIFTS_M as a share of the best: of points on the sensor's side of the water, and of all.
    georeferenced : bool
        Whether another program has placed the points. Their mount then has no effect.
    """

    sensor: str
    z_m: float
    sided: Array
    free: Array
    georeferenced: bool = False

    @property
    def shift_m(self) -> float:
        """The shift upwards at which the points lie best on the target."""
        return _middle(self.sided)

    @property
    def sign(self) -> bool:
        """Whether a reversed sign of z explains the shift."""
        return not self.georeferenced and bool(abs(self.shift_m + 2 * self.z_m) < SIGN_M)

    @property
    def cause(self) -> str:
        """The setting, or the data, that may be wrong by the shift."""
        return f"the heights of {self.sensor}.frame" if self.georeferenced else f"{self.sensor}.mount.z_m"

    @property
    def off(self) -> bool:
        """Whether the points fit clearly better at another height.

        With only a wrong water level, ``free`` is high without any shift. In this case a better height counts only if a
        reversed sign of z explains it.
        """
        far = abs(self.shift_m) >= LEAST_M and self.sided[HERE] < WORSE
        return far and (self.sign or self.free[HERE] < WORSE)


def height_findings(
    track: InsTrack, samples: Sequence[PointSample], closest: ClosestSurface, water_m: float, height_m: float
) -> Iterator[Finding]:
    """Yield findings for wrong heights, if points miss the target because of them.

    Parameters
    ----------
    track : InsTrack
        The INS's track.
    samples : Sequence[PointSample]
        Points of each sensor.
    closest : ClosestSurface
        The target's surface.
    water_m : float
        Height of the water in the target frame.
    height_m : float
        The configured target.origin.height_m.
    """
    fits = [fit for fit in (_fit(track, sample, closest, water_m) for sample in samples) if fit is not None]
    common = common_shift(fits)
    if common is not None and len(fits) == len(samples):
        yield Finding("height", _target_is_off(fits, common, height_m))
        return
    off = [fit for fit in fits if fit.off]
    if len(off) > 1:
        both = ", ".join(f"{NAMES[fit.sensor]} if they lay {way(fit.shift_m, 'higher', 'lower')}" for fit in off)
        yield Finding(
            "height",
            f"heights do not agree: the target is hit by {both}: check target.origin.height_m, "
            f"{' and '.join(fit.cause for fit in off)} (z is up: a sonar below the INS has a negative one)",
        )
    others_fit = all(abs(fit.shift_m) < LEAST_M for fit in fits if not fit.off)
    for fit in off if len(off) == 1 and others_fit else []:
        unless = f"; or correct target.origin.height_m ({height_m - fit.shift_m:.1f} in place of {height_m:g})"
        alone = len(fits) < len(samples)  # the other sensor hits nothing at any height
        yield Finding(
            "target",
            f"{fit.sensor}: {NAMES[fit.sensor]} miss the target, but hit it {_remedy(fit)}{unless if alone else ''}",
        )


def _remedy(fit: Fit) -> str:
    if fit.georeferenced:
        which = f"if they lay {way(fit.shift_m, 'higher', 'lower')}"
        return f"{which}: are their heights above sea level? Export them above the ellipsoid"
    remedy = "reverse its sign (z is up)" if fit.sign else "measure it again"
    new_m = -fit.z_m if fit.sign else round(fit.z_m + fit.shift_m, 1)
    return f"with {fit.sensor}.mount.z_m = {new_m:g} in place of {fit.z_m:g}: {remedy}"


def _target_is_off(fits: Sequence[Fit], shift_m: float, height_m: float) -> str:
    which, all_of_them = " and ".join(NAMES[fit.sensor] for fit in fits), "both hit" if len(fits) > 1 else "hit"
    higher = "higher" if shift_m > 0 else "lower"
    alone = f", or if {fits[0].cause} {'are' if fits[0].georeferenced else 'is'} that much {higher}"
    return (
        f"{which} miss the target, and {all_of_them} it if target.origin.height_m is about "
        f"{way(-shift_m, 'higher', 'lower')} ({height_m - shift_m:.1f} in place of {height_m:g})"
        f"{alone if len(fits) == 1 else ''}: is it, or the INS's height, above sea level? Give both above the ellipsoid"
    )


def way(shift_m: float, up: str, down: str) -> str:
    """Return the size of a shift and its direction as text.

    >>> way(-4.53, "higher", "lower")
    '4.5 m lower'
    """
    return f"{abs(shift_m):.1f} m {up if shift_m > 0 else down}"


@dataclass(frozen=True)
class SideOfWater:
    """The side of the water on which a sensor sees the target: the laser above it, the sonar below it."""

    sensor: str
    water_m: float

    def visible(self, points: Array) -> NDArray[np.bool_]:
        """Return a mask (...): true for each of the points (..., 3) m, target frame, on that side."""
        return points[..., 2] > self.water_m if self.sensor == "laser" else points[..., 2] < self.water_m


def profile(
    points: Array,
    closest: ClosestSurface,
    shifts_m: Array,
    side: SideOfWater | None = None,
    reach_m: float = REACH_M,
) -> Array:
    """Return the agreement (k,) of points with the target after each shift upwards.

    The agreement is the mean over all points of 1 - (d / reach)², with the distance d from the target. Points beyond
    the reach or on the other sensor's side of the water count 0.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Points, m, in the frame of the surface.
    closest : ClosestSurface
        The target's surface.
    shifts_m : ndarray, shape (k,)
        Shifts upwards.
    side : SideOfWater or None
        The side of the water on which points count; None: both sides.
    reach_m : float
        Distance from a face beyond which a point counts 0.
    """
    sums = np.zeros(len(shifts_m))
    for some in np.array_split(np.arange(len(shifts_m)), 1 + len(shifts_m) * len(points) // AT_ONCE):
        moved = points + shifts_m[some, None, None] * np.array([0.0, 0.0, 1.0])
        use = closest.around(moved, reach_m)
        if side is not None:
            use &= side.visible(moved)
        near = moved[use]
        on, _ = closest(near)
        squares = np.sum((near - on) ** 2, axis=1) / reach_m**2
        sums[some] = np.bincount(np.nonzero(use)[0], np.maximum(0.0, 1.0 - squares), len(some))
    return sums / len(points)


def _fit(track: InsTrack, sample: PointSample, closest: ClosestSurface, water_m: float) -> Fit | None:
    """Return the fit of a sensor's points; None if they are too few or hit nothing at any height."""
    points = place_points(track, sample.in_good_legs(track))
    points = points[np.isfinite(points[:, 0])]
    if len(points) < FEWEST:
        return None
    sides = (SideOfWater(sample.sensor, water_m), None)
    sided, free = (profile(points, closest, SHIFTS_M, side) for side in sides)
    return None if sided.max() < FIT else Fit(
        sample.sensor, sample.mount.z_m, sided / sided.max(), free / free.max(), sample.georeferenced
    )


def common_shift(fits: Sequence[Fit]) -> float | None:
    """Return the shift upwards (m) that brings the points of all sensors onto the target.

    Return None if they lie there without a shift, or if no single shift suits all sensors.
    """
    if not fits:
        return None
    together = np.min([fit.sided for fit in fits], axis=0)
    shift = _middle(together)
    lies = together[HERE] >= WORSE * together.max() or min(fit.free[HERE] for fit in fits) >= WORSE
    return None if lies or abs(shift) < LEAST_M or together.max() < TOGETHER else shift


def _middle(fits: Array) -> float:
    """Return the middle (m) of the shifts whose agreement is as good as the best."""
    good = SHIFTS_M[fits >= LIKE * fits.max()]
    return float((good.min() + good.max()) / 2)
