"""Errors of the recorded poses: white noise of each record, and drift with values at knots; a test of it by passes.

Both sensors are fixed to one body, so that at one instant they share the error e = (δ, ω) of its pose (target frame;
X -> X + δ + ω × r). Between records the error is interpolated like the poses. It has two parts:

    e(t) = ξ(t) + (1 - s) w_k + s w_{k+1},        t = t_k + s (t_{k+1} - t_k)

* w_k: white noise of record k, w ~ N(0, W), W diagonal (position, attitude);
* ξ: drift, a first-order Gauss-Markov process of standard deviations σ (6,) and time constant τ, through all passes and
  the time between them (Gelb 1974, 3.8). It has values at *knots* and is linear between them. For two knots d apart,
  ξ_{j+1} = φ ξ_j + N(0, (1 - φ²) σ²), φ = exp(-d / τ).

**Distance of the knots.** For times much shorter than τ the drift is a random walk of rate q = 2 σ² / τ (m²/s). Linear
interpolation omits the bridge between two knots: variance q s (1 - s) d at the share s of their distance, in the mean
q d / 6, independent from one bridge to the next. The integral of its covariance over time is its power density below
1/d: a bridge's own integral has the variance q d³ / 12, per time d, so that q d² / 12 is missing (both-sided, m² s).
The drift itself has q / (2πf)² at the frequency f. So the model omits the share (2πf d)² / 12 of the drift's power at
f, *whatever q is*: the same knots do for every σ and τ. The boat's roll tells the adjustment most: a roll error or a
lever arm changes residuals at the frequency of the roll, and, because the change depends on the roll, at twice that. So
the knots are so close that at most :data:`OMITTED` is missing there:

    d = √(12 OMITTED) / (2π · 2 f_roll):        0.12 s for a roll of 4.5 s

(With 0.5 s, a quarter of the drift's power at 0.6 Hz was missing, and a laser's sigmas of x, y, z came out 4 to 7 % too
small.)

**Test of the drift**: the difference between its mean in one pass and its mean in the others is compared with the INS's
sigmas. An error of one sensor in one pass (a bracket that moves, a clock that jumps) does not always stay in the
residuals. If the INS may drift, the adjustment turns the boat in that pass until both sensors fit. This needs a drift
larger than the INS's sigmas allow, and the test shows it. (5 mm more range in one of four passes leaves 1 mm in the
residuals, and turns the boat by 0.15° in heading.) With weights c, Σ c ξ = (mean of the pass's knots) - (mean of all
others), and ξ the Gauss-Markov process,

    Var(Σ c ξ) = c' K c,    K_ij = σ² exp(-|t_i - t_j| / τ)

for each of the six components. The estimate of such a process has at most that variance (the estimate is the
conditional mean: Var ξ = variance of the estimate + variance of its error). So a test against the root of that variance
may reject too rarely, never too often.

An INS's errors of roll and pitch may keep to the earth (tilt of its platform) or to the boat (its accelerometers); the
adjustment has them in the target frame, as if they kept to the earth. An error β that keeps to the boat is ξ = R_z(α) β
there, α the angle of the boat's bow about z, anticlockwise: on the opposite course it has the opposite sign. With the
horizontal turns as a complex number, ξ_x + i ξ_y = exp(iα) (β_x + i β_y), both of one σ,

    Var(Σ c ξ) = Re(d* K d),    d_j = c_j exp(iα_j),

c' K c of weights that turn with the boat: as large as the first on one course, mostly larger between opposite ones.
Which of the two an INS does is not known. The variance of any mixture is a weighted mean of both, so the test takes the
larger one. (In a lock that is passed both ways, a roll error of 2.5 sigmas that kept to the boat was five sigmas of the
first kind, and 4 of 60 good sessions were rejected.)
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.geometry.rotations import exp_so3
from pipeline.maths.geometry.trajectory import NS_PER_S, Trajectory

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]
N_POSE = 6  # components of a pose error: position x, y, z, turn x, y, z
OMITTED = 0.01  # share of the drift's power, at twice the frequency of the boat's motion, that is missing between knots
LEAST_SPACING_S, LARGEST_SPACING_S = 0.05, 0.5  # bounds of the distance of two knots: an agile boat, a still one
SHIFTS, TURNS, ROLL_PITCH = slice(0, 3), slice(3, 6), slice(3, 5)  # components of a pose error


@dataclass(frozen=True)
class PoseNoise:
    """Standard deviations of the pose errors, position (m) and turn (rad).

    white (6,): of each record's noise; drift (6,): of the drift, with its time constant. Zero: no such error.
    """

    white: Array
    drift: Array
    time_constant_s: float

    @property
    def drifts(self) -> bool:
        """Return whether any component drifts."""
        return bool(np.any(self.drift > 0))

    def scaled(self, white: float) -> "PoseNoise":
        """Return the noise with the variance of its white part multiplied by this factor."""
        return replace(self, white=self.white * np.sqrt(white))

    def drifting(self, shifts: float, turns: float, time_constant: float) -> "PoseNoise":
        """Return the noise with the drift's standard deviations and its time constant multiplied by these factors."""
        drift = self.drift * np.repeat([shifts, turns], N_POSE // 2)
        return replace(self, drift=drift, time_constant_s=self.time_constant_s * time_constant)


def knot_spacing(motion_hz: float) -> float:
    """Return the largest distance (s) of two knots of the drift, by the frequency of the boat's motion.

    >>> round(knot_spacing(1 / 4.5), 2), knot_spacing(0.0)
    (0.12, 0.5)
    """
    if motion_hz <= 0:
        return LARGEST_SPACING_S
    spacing_s = np.sqrt(12 * OMITTED) / (2 * np.pi * 2 * motion_hz)
    return float(np.clip(spacing_s, LEAST_SPACING_S, LARGEST_SPACING_S))


@dataclass(frozen=True)
class Knots:
    """The instants at which the drift is estimated.

    record (k,) ascending: the INS records that are knots; seconds (k,): their times; inner (k - 1,): mask, true if
    observations may lie between a knot and the next (false in a gap, such as between two passes).
    """

    record: Integers
    seconds: Array
    inner: NDArray[np.bool_]

    def interval_of(self, record: Integers) -> Integers:
        """Return the number (n,) of the last knot before the interval from each record (n,) to the next."""
        return np.asarray(np.clip(np.searchsorted(self.record, record, side="right") - 1, 0, len(self.record) - 2))


def place_knots(record: Integers, seconds: Array, spacing_s: float, gap_s: float) -> Knots:
    """Return knots for observations, evenly spaced over each run of records without a gap.

    Parameters
    ----------
    record : (m,) array
        Last INS record before each observation, ascending, each once.
    seconds : (n,) array
        Times of all INS records.
    spacing_s : float
        Largest distance of two knots, if the records allow it.
    gap_s : float
        A longer time without observations ends a run.
    """
    breaks = np.flatnonzero(np.diff(seconds[record]) > gap_s)
    runs, inner = [], []
    for first, last in zip(record[np.r_[0, breaks + 1]], record[np.r_[breaks, len(record) - 1]] + 1, strict=True):
        count = max(1, int(np.ceil((seconds[last] - seconds[first]) / spacing_s)))
        times = np.linspace(seconds[first], seconds[last], count + 1)
        nearest = first + np.searchsorted(seconds[first : last + 1], times - 1e-9)
        run = np.unique(np.clip(nearest, first, last))
        runs.append(run)
        inner.append(np.r_[np.ones(len(run) - 1, dtype=bool), False])
    knots = np.concatenate(runs)
    return Knots(knots, seconds[knots], np.concatenate(inner)[:-1])


@dataclass(frozen=True)
class DriftEstimate:
    """The estimated drift ξ: values (k, 6), m and rad, at its knots, target frame."""

    knots: Knots
    values: Array

    @classmethod
    def zero(cls, knots: Knots) -> "DriftEstimate":
        """Return a drift of zero at these knots."""
        return cls(knots, np.zeros((len(knots.record), N_POSE)))

    def at(self, seconds: Array) -> Array:
        """Return ξ (n, 6) at these times (n,), linear between the knots."""
        return np.array([np.interp(seconds, self.knots.seconds, column) for column in self.values.T]).T

    def updated(self, step: Array) -> "DriftEstimate":
        """Return the drift after a step (k, 6)."""
        return DriftEstimate(self.knots, self.values + step)

    def corrected(self, trajectory: Trajectory) -> Trajectory:
        """Return a trajectory in the target frame, corrected by the drift: position p + δ, attitude Exp(ω) R."""
        error = self.at((trajectory.t_ns - trajectory.t_ns[0]) / NS_PER_S)
        R_target_from_body = exp_so3(error[:, 3:]) @ trajectory.R_frame_from_body
        return Trajectory.build(trajectory.t_ns, trajectory.positions_m + error[:, :3], R_target_from_body)


@dataclass(frozen=True)
class PassDrift:
    """Differences of the drift between passes.

    passes (p,): numbers of the passes; difference (p, 6), m and rad: mean of the drift in each pass minus its mean in
    all others; sigma (p, 6): standard deviation of this difference by the drift process.
    """

    passes: Integers
    difference: Array
    sigma: Array


def drift_between_passes(
    drift: DriftEstimate, noise: PoseNoise, pass_of_knot: Integers, bow_rad: Array
) -> PassDrift:
    """Return the mean of the drift in each pass minus its mean in the others; for a single pass, its mean itself.

    Parameters
    ----------
    drift : DriftEstimate
        The estimated drift, k knots.
    noise : PoseNoise
        Standard deviations and time constant of the drift; the turns about x and y have one standard deviation.
    pass_of_knot : (k,) array
        Number of each knot's pass; negative: no pass.
    bow_rad : (k,) array
        Angle of the boat's bow at each knot about the target's z axis, anticlockwise.
    """
    passes = np.unique(pass_of_knot[pass_of_knot >= 0])
    inside = pass_of_knot[:, None] == passes
    outside = (pass_of_knot >= 0)[:, None] & ~inside
    weight = inside / inside.sum(axis=0) - outside / np.maximum(outside.sum(axis=0), 1)  # (k, p)
    decay = np.exp(-np.diff(drift.knots.seconds, prepend=drift.knots.seconds[:1]) / noise.time_constant_s)
    of_earth = _variance(weight, decay)
    of_boat = _variance(weight * np.exp(1j * bow_rad)[:, None], decay)
    sigma = np.sqrt(of_earth)[:, None] * noise.drift
    sigma[:, ROLL_PITCH] = np.sqrt(np.maximum(of_earth, of_boat))[:, None] * noise.drift[ROLL_PITCH]
    return PassDrift(passes, weight.T @ drift.values, sigma)


def _variance(weight: Array | Complex, decay: Array) -> Array:
    """Return Re(d* K d) (p,) of weights d (k, p), of a process of variance 1 that decays by these factors (k,)."""
    before, square = np.zeros(weight.shape[1], dtype=weight.dtype), np.zeros(weight.shape[1])
    for at_knot, factor in zip(weight, decay, strict=True):  # Σ_{j < i} d_j exp(-(t_i - t_j) / τ), from knot to knot
        before *= factor
        square += np.real(np.conj(at_knot) * (at_knot + 2 * before))
        before += at_knot
    return np.maximum(square, 0.0)
