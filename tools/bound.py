"""Compute the Cramér-Rao bound of simulated sessions: no unbiased estimator has a smaller covariance.

The bound is independent of the adjustment and imports nothing from it. It uses true poses, true noise and true rays.
Derivatives are differences of a forward model of its own. The INS errors are unknowns with a prior, record by record,
in one sparse matrix. A ray whose whole footprint lies on a plane n · X = d gives one equation

    n · X(range, angles; mount parameters, pose) - d - (two turns and a shift of the plane's family) = 0

whose variance Σ (n · dX/ds)² σ_s² follows from the noise of its range and angles. The unknowns are x (the six mount
parameters, the families' turns and shifts, biases) and e (the INS errors: white at records, Gauss-Markov at knots,
linear between them). Their information matrix is

    [ Jxᵀ W Jx    Jxᵀ W Je     ]
    [ Jeᵀ W Jx    Jeᵀ W Je + P ]        W: 1 / variance, P: inverse of the covariance of e.

Let N be what it leaves of x after e is eliminated. Without biases the bound is the first 6 x 6 block of N⁻¹. An
estimator that allows for biases (:mod:`tools.bound_biases`), known to be zero within their sigmas, Q, gives up some of
that: the best of all such errs by noise with the covariance C N C, C = (N + Q⁻¹)⁻¹. That is the bound here.

Where the laser itself is calibrated (:func:`laser_bound`), the mount parameters are the laser's and there is no sonar.
One displacement of the whole target, plumb within a sigma, then takes the place of the families' turns and shifts in x.

    python -m tools.bound [SCENARIO.yaml] [--seeds 4]
"""

import argparse
from pathlib import Path

import numpy as np
from scipy.sparse import block_diag, csc_matrix, csr_matrix, diags, hstack, identity, kron
from scipy.sparse.linalg import splu

from pipeline.config.pool import Segment
from pipeline.gps_time import NS
from pipeline.simulation.ins_errors import pose_sigmas
from pipeline.simulation.scenario import Scenario, load_scenario
from tools.bound_biases import derivatives, sigmas
from tools.forward_model import DEFAULTS, NORMALS, Array, Rays, World

KNOT_S = 0.0625  # of the drift: with 0.25 s the bound of a laser was 3 % too low
STEP = np.array([1e-5] * 3 + [1e-4] * 3)  # of differences, rad and m


def equations(world: World, rays: Rays, calibrated: str = "mbes") -> tuple[Array, Array, Array]:
    """Return Jx (n, 42), or (n, 12) for the laser; derivatives by the pose errors (n, 6); weights (n,).

    Parameters
    ----------
    world
        The truth of the session.
    rays
        The rays, one equation each.
    calibrated
        The sensor whose mount is estimated, "mbes" or "laser".
    """
    normal, none, steps = world.normals[rays.plane], np.zeros(6), np.diag(STEP)

    def difference(mount_error: Array, pose_error: Array) -> Array:
        """Return central differences along the normal (n,)."""
        ends = [world.placed(rays, rays.points_m, sign * mount_error, sign * pose_error) for sign in (1, -1)]
        return np.asarray(np.einsum("ni,ni->n", normal, ends[0] - ends[1]) / 2)

    here = world.placed(rays, rays.points_m, none, none)
    pose = np.stack([difference(none, step) for step in steps], axis=1) / STEP
    of_x = np.zeros((len(here), 6 + 3 * len(NORMALS)))
    if rays.sensor == calibrated:
        of_x[:, :6] = np.stack([difference(step, none) for step in steps], axis=1) / STEP
    family = world.family[rays.plane]
    sign = np.einsum("ni,ni->n", normal, NORMALS[family])  # tops and bottoms turn together
    for k, plane in enumerate(NORMALS):
        rows = family == k
        turns = (here[rows] - world.centres_m[k]) @ np.linalg.svd(plane[None])[2][1:].T
        of_x[rows, 6 + 3 * k : 9 + 3 * k] = sign[rows, None] * np.column_stack([turns, np.ones(len(turns))])
    ends = [world.placed(rays, rays.points_m + moved, none, none) for moved in np.moveaxis(rays.noise_m, 2, 0)]
    if calibrated == "laser":
        of_x = np.hstack([of_x[:, :6], normal, np.cross(here, normal)])
    else:
        of_x = np.hstack([of_x, derivatives(world, rays, of_x[:, 6:])])
    variance = sum(np.einsum("ni,ni->n", normal, end - here) ** 2 for end in ends)
    return of_x, pose, rays.clean / variance


def bound(scenario: Scenario, seed: int, biases: bool = True, segment: Segment = DEFAULTS) -> Array:
    """Return the bound (6, 6): rotation about body x, y, z in rad and lever arm in m, as in calibration.json.

    ``biases``: whether the estimator allows for biases within the default sigmas; ``segment``: limits of labelling.
    """
    world = World(scenario, seed, segment)
    rays = [world.laser(k) for k in world.movement.passes] + [world.mbes(k) for k in world.movement.passes]
    information = _information(scenario, rays, [equations(world, part) for part in rays])
    if not biases:
        return _inverse(information[:18, :18])[:6, :6]
    known = np.r_[np.zeros(18), sigmas() ** -2.0]
    inverse = _inverse(information + np.diag(known))
    return np.asarray(inverse @ information @ inverse)[:6, :6]


def laser_bound(scenario: Scenario, seed: int, plumb_deg: float) -> Array:
    """Return the bound (6, 6) of the laser's mount, in rad and m.

    Parameters
    ----------
    scenario
        The simulated session, whose target is exactly as designed.
    seed
        Its seed.
    plumb_deg
        Sigma of the target's plumb.
    """
    world = World(scenario, seed)
    rays = [world.laser(k) for k in world.movement.passes]
    plumb = np.r_[np.zeros(9), [np.radians(plumb_deg) ** -2.0] * 2, 0.0]
    information = _information(scenario, rays, [equations(world, part, "laser") for part in rays])
    return _inverse(information + np.diag(plumb))[:6, :6]


def _information(scenario: Scenario, rays: list[Rays], equations: list[tuple[Array, Array, Array]]) -> Array:
    """Return the information N (x, x) of the rays about x."""
    of_x, of_pose, weight = (np.concatenate([part[i] for part in equations]) for i in range(3))
    normal = np.asarray(of_x.T @ (weight[:, None] * of_x))
    of_errors, prior = ins_errors(scenario, np.concatenate([part.t_ns for part in rays]) / NS, of_pose)
    if of_errors.shape[1]:
        inner = csc_matrix(of_errors.T @ diags(weight) @ of_errors + prior)
        across = of_errors.T @ (weight[:, None] * of_x)
        factors = splu(inner, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        normal -= across.T @ factors.solve(across)
    return normal


def _inverse(matrix: Array) -> Array:
    scale = 1 / np.sqrt(np.diag(matrix))
    return np.asarray(scale[:, None] * np.linalg.inv(scale[:, None] * matrix * scale) * scale)


def ins_errors(scenario: Scenario, seconds: Array, of_pose: Array) -> tuple[csr_matrix, csr_matrix]:
    """Return Je (n, e), for errors of unit variance, and P (e, e), both sorted by time.

    In this order a knot comes after the records that depend on it.

    Parameters
    ----------
    scenario
        The simulated session, for the noise and drift of its INS.
    seconds
        (n,): times of the equations.
    of_pose
        (n, 6): derivatives of the equations by the pose errors.
    """
    white, drift = scenario.ins.white, scenario.ins.drift
    position = drift.horizontal_m, drift.horizontal_m, drift.vertical_m
    attitude = drift.roll_pitch_deg, drift.roll_pitch_deg, drift.heading_deg
    kinds = (
        (pose_sigmas((white.position_m,) * 3, (white.attitude_deg,) * 3), 1 / scenario.ins.rate_hz, 0.0, 0.0),
        (pose_sigmas(position, attitude), KNOT_S, drift.time_constant_s, KNOT_S),
    )
    blocks, priors, when = [], [], []
    for scale, spacing_s, constant_s, behind_s in kinds:
        if not scale.any():
            continue
        place = (seconds - seconds.min()) / spacing_s
        knots, before = np.unique(np.concatenate([np.floor(place), np.floor(place) + 1]), return_inverse=True)
        column, share, rows = before[: len(place)], place - np.floor(place), np.arange(len(place))
        parts = []
        for offset, part in ((0, 1 - share), (1, share)):
            shape = (len(place), 6 * len(knots))
            for k in range(6):
                values = part * of_pose[:, k] * scale[k]
                parts.append(csr_matrix((values, (rows, 6 * (column + offset) + k)), shape=shape))
        blocks.append(sum(parts[1:], parts[0]))
        priors.append(_markov(knots * spacing_s, constant_s))
        when.append(np.repeat(knots * spacing_s + behind_s, 6))
    if not blocks:
        return csr_matrix((len(seconds), 0)), csr_matrix((0, 0))
    order = np.argsort(np.concatenate(when), kind="stable")
    return hstack(blocks, format="csc")[:, order], block_diag(priors, format="csc")[:, order][order]


def _markov(seconds: Array, constant_s: float) -> csr_matrix:
    """Return the inverse of the covariance exp(-|t - t'| / constant) of six interleaved processes; 0: white noise."""
    f = np.exp(-np.diff(seconds) / constant_s) if constant_s else np.zeros(len(seconds) - 1)
    gain = 1 / (1 - f**2)
    diagonal = np.ones(len(seconds))
    diagonal[:-1] += f**2 * gain
    diagonal[1:] += f**2 * gain
    return csr_matrix(kron(diags([diagonal, -f * gain, -f * gain], [0, 1, -1]), identity(6)))


def main() -> None:
    """Print the sigmas of the bound for a scenario."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "scenario", nargs="?", type=Path, metavar="SCENARIO", help="YAML file of a scenario; default: the built-in one"
    )
    parser.add_argument("--seeds", type=int, default=4, help="number of sessions over which the bound is averaged")
    options = parser.parse_args()
    scenario = load_scenario(options.scenario)
    sigma = np.sqrt(np.diag(np.mean([bound(scenario, seed) for seed in range(1, options.seeds + 1)], axis=0)))
    print("pitch, roll, yaw (about body x, y, z):", np.round(np.degrees(sigma[:3]), 5), "°")
    print("x, y, z:", np.round(1000 * sigma[3:], 4), "mm")


if __name__ == "__main__":
    main()
