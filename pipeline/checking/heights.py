"""Vertical offsets between the sensors' points and the target.

If both sensors miss it by the same height, target.origin.height_m is wrong. If one of them does, the z of its mount is
wrong; where others have placed the laser's points, the surface that their heights are above.

The laser sees the target above the water alone, and the sonar below it alone. So points count only on their own side of
the water: a shift downwards loses the laser's lowest points and the sonar's deepest, one upwards the laser's highest
and the sonar's shallowest. Where a target repeats, its ends tell one repetition from the next.
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
REACH_M = 0.5  # from a face, beyond which a point counts nothing
FARTHEST_M, STEP_M = 50.0, 0.25
SHIFTS_M = np.arange(-FARTHEST_M, FARTHEST_M + STEP_M / 2, STEP_M)
HERE = len(SHIFTS_M) // 2
LEAST_M = 0.8  # less may be a wrong target.water_level_m; the calibration finds its share of it by itself
LIKE = 0.97  # of the best: as good
TOGETHER = 0.8  # of its own best that each sensor must have at the common shift
WORSE = 0.8  # of that, the most that the heights as given may have
FEWEST, FIT = 50, 0.05  # points in passes, and the share of them on the target at the best shift
SIGN_M = 0.5  # a shift as near to twice a lever arm is its sign


@dataclass(frozen=True)
class Fit:
    """How well one sensor's points lie on the target, by shift.

    Attributes
    ----------
    sensor : str
        ``laser`` or ``mbes``.
    z_m : float
        Height in its mount, ``mount.z_m``.
    sided, free : ndarray, shape (k,)
        Agreement at each of SHIFTS_M as a share of the best: on the sensor's own side of the water, and anywhere.
    georeferenced : bool
        Whether others have placed the points, so that the mount moves nothing.
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
        """Whether the reversed sign of z is the shift."""
        return not self.georeferenced and bool(abs(self.shift_m + 2 * self.z_m) < SIGN_M)

    @property
    def cause(self) -> str:
        """The setting, or the data, that may be wrong by the shift."""
        return f"the heights of {self.sensor}.frame" if self.georeferenced else f"{self.sensor}.mount.z_m"

    @property
    def off(self) -> bool:
        """Whether the points lie clearly better elsewhere; a wrong water level leaves them on the target."""
        far = abs(self.shift_m) >= LEAST_M and self.sided[HERE] < WORSE
        return far and (self.sign or self.free[HERE] < WORSE)


def height_findings(
    track: InsTrack, samples: Sequence[PointSample], closest: ClosestSurface, water_m: float, height_m: float
) -> Iterator[Finding]:
    """Yield the wrong height where the points of a sensor are offset vertically from the target.

    Parameters
    ----------
    track : InsTrack
        Track of the INS.
    samples : Sequence[PointSample]
        Points of each sensor.
    closest : ClosestSurface
        The target's surface.
    water_m : float
        Height of the water in the target frame.
    height_m : float
        target.origin.height_m as it is configured.
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
    """Return a shift and its direction.

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
        """Return which points (n, 3) m in the target frame are on that side."""
        return points[:, 2] > self.water_m if self.sensor == "laser" else points[:, 2] < self.water_m


def profile(
    points: Array,
    closest: ClosestSurface,
    shifts_m: Array,
    side: SideOfWater | None = None,
    reach_m: float = REACH_M,
) -> Array:
    """Return how well points lie on the target when they are shifted upwards, (k,).

    It is the mean of 1 - (d / reach)², none beyond the reach or on the other sensor's side of the water.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        In metres, in the frame of the surface.
    closest : ClosestSurface
        The target's surface.
    shifts_m : ndarray, shape (k,)
        The shifts.
    side : SideOfWater or None
        Where the sensor can see the target; None: anywhere.
    reach_m : float
        Distance from a face beyond which a point counts nothing.
    """
    scores = []
    for shift in shifts_m:
        moved = points + np.array([0.0, 0.0, shift])
        if side is not None:
            moved = moved[side.visible(moved)]
        moved = moved[closest.around(moved, reach_m)]
        on, _ = closest(moved)
        squares = np.sum((moved - on) ** 2, axis=1) / reach_m**2
        scores.append(float(np.sum(np.maximum(0.0, 1.0 - squares))) / len(points))
    return np.array(scores)


def _fit(track: InsTrack, sample: PointSample, closest: ClosestSurface, water_m: float) -> Fit | None:
    """Return the fit of a sensor's points; None where they are few, or hit nothing at any height."""
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
    """Return how far up all sensors' points have to go to lie on the target.

    None where they lie there as they are, or where no single shift brings all of them there.
    """
    if not fits:
        return None
    together = np.min([fit.sided for fit in fits], axis=0)
    shift = _middle(together)
    lies = together[HERE] >= WORSE * together.max() or min(fit.free[HERE] for fit in fits) >= WORSE
    return None if lies or abs(shift) < LEAST_M or together.max() < TOGETHER else shift


def _middle(fits: Array) -> float:
    """Return the middle of the shifts that are as good as the best."""
    good = SHIFTS_M[fits >= LIKE * fits.max()]
    return float((good.min() + good.max()) / 2)
