"""The provisional adjustment: mount and trajectory for labelling, from a sample of the points.

Labels made with the recorded trajectory are wrong where it drifts. The laser sees dry tops and bottoms at 3° to 12°.
There an error of 2 cm in height moves the place where a ray meets the plane by 10 to 20 cm, and points of a slanted
face are taken for points of the top above it. On such faces a point's sigma is 1 mm, so that a few wrong labels move
the result by several sigmas. So a sample of the points is labelled and adjusted. Mount and drift then correct the
provisional mount and the trajectory, and the sample is labelled again.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from pipeline.adjustment.consider import known_parameters
from pipeline.adjustment.problem import CalibrationProblem, designed_planes
from pipeline.adjustment.two_starts import chosen_iteration
from pipeline.adjustment.weighted_iteration import IterationSettings, WeightedIteration
from pipeline.adjustment.wet_errors import BUILT_DEG, BUILT_M, outward_of, wet_errors, wet_faces_uncertain
from pipeline.artefacts.sampling import sample_rows
from pipeline.artefacts.streams import Batch, MemoryPart, Stream, point_array
from pipeline.config.stage_settings import FacesAsBuilt
from pipeline.maths.adjustment.pose_errors import N_POSE
from pipeline.maths.adjustment.pseudo_observations import N_DISPLACEMENT, DesignPrior, displacement
from pipeline.maths.geometry.rotations import exp_so3, log_so3
from pipeline.maths.target.model import TargetModel
from pipeline.target.gate import fitting_gate_m
from pipeline.target.labelled_points import LabellingContext, label_batch

ROUNDS = 2  # adjustments of the sample, the first without white noise; a third changes less than 0.1 % of the labels
READ = 1_000_000  # about this many points of a stream are looked at
SAMPLE = {"laser_pool": 60_000, "soundings_pool": 20_000}  # about this many of them near the target are used
LEAST_KEPT = 0.8  # of the labelled points of each sensor, by an adjusted mount that is better
BEYOND_M = 0.5  # a point farther outside the target's bounds is not near it
BUILT_RAD = float(np.radians(BUILT_DEG))
FOUND_RAD, FOUND_M = float(np.radians(0.3)), 0.03  # against planes that were found in laser points: of the INS's drift
SENSOR = {"laser_labelled": "laser", "soundings_labelled": "mbes"}  # by the name of the labelled stream


def design_without_place(target: TargetModel) -> DesignPrior:
    """Return the design as prior information, with errors of an ordinary building site, at an unknown place.

    Without it the adjustment knows P1 and P3 only as well as the drift lets it, because the boat sees them one after
    the other: 2 mm, which move one label in a hundred.
    """
    open_place = np.full(N_DISPLACEMENT, np.inf)
    sigmas = (FOUND_RAD, FOUND_M) if target.found else (BUILT_RAD, BUILT_M)
    return DesignPrior(designed_planes(target), *sigmas, np.zeros(N_DISPLACEMENT), open_place)


def uncertain_wet_faces(problem: CalibrationProblem, as_built: FacesAsBuilt) -> CalibrationProblem:
    """Return the problem with shifts and turns of the wet faces as unknowns, if these may stand far off the dry ones.

    Two wet walls that are turned against each other by 0.2° fit the dry ones only if the INS drifts by centimetres.
    Where they must fit, the provisional adjustment drifts so, and takes labels away with it.
    """
    if not wet_faces_uncertain(as_built):
        return problem
    state = problem.model.coarse
    errors = wet_errors(state.names, as_built, 0.0, outward_of(problem.model.faces, state))
    known = known_parameters(state, errors, ())
    return replace(problem, prior=replace(problem.prior, parameters=known, from_start=True))


def sample_near_target(stream: Stream, name: str, count: float, context: LabellingContext) -> Batch:
    """Return a sample of a stream's points near the target.

    Parameters
    ----------
    stream
        Points in the pool frame.
    name
        Name of the stream, "laser_pool" or "soundings_pool".
    count
        Number of points in the stream.
    context
        The target's bounds and pose.
    """
    looked_at = max(1.0, count / READ)  # one in so many
    pieces = list(stream.fold(_near_target, looked_at, context))
    columns = {column: np.concatenate([piece[column] for piece in pieces]) for column in pieces[0]}
    # the same hash chooses again, so its share is that of the whole stream
    return sample_rows(columns, looked_at * max(1.0, len(columns["t_ns"]) / SAMPLE[name]))


def _near_target(batch: Batch, one_in: float, context: LabellingContext) -> Batch:
    sample = sample_rows(batch, one_in)
    points = context.target.frame.points_from_pool(point_array(sample, "pool_m"))
    low, high = context.model.bounds()
    near = np.all((points >= low - BEYOND_M) & (points <= high + BEYOND_M), axis=1)
    return {name: column[near] for name, column in sample.items()}


def with_adjusted_sample(
    context: LabellingContext,
    sample: Mapping[str, Batch],
    problem_at: Callable[[LabellingContext], CalibrationProblem],
    settings: IterationSettings,
    gap_s: float,
) -> LabellingContext:
    """Return the context with mount and trajectory from the adjustment of a sample.

    Where the adjustment has no solution, the context stays as it is; stage adjust then tells why. So it does where the
    adjusted mount loses a good part of the points: then they were too few to adjust by. The mount's ``label_change``
    tells, and stage report warns.

    Parameters
    ----------
    context
        Mount and trajectory by search.
    sample
        Points by the name of their stream, from :func:`sample_near_target`.
    problem_at
        Function from the context to the calibration problem, which starts from the context's mount.
    settings
        Settings of the iteration.
    gap_s
        A longer time (s) without observations interrupts the knots of the drift.
    """
    labelled = labelled_sample(sample, context)
    if not all(_counts(labelled)):
        return context  # stage segment tells why no point has a label
    number, rounds = 0, ROUNDS
    while number < rounds:
        number += 1
        problem = problem_at(context)
        if number < ROUNDS:  # enough to label by: white noise of single records takes half the time
            noise = replace(problem.prior.noise, white=np.zeros(N_POSE))
            problem = replace(problem, prior=replace(problem.prior, noise=noise))
        adjustment = chosen_iteration(problem, labelled, settings, gap_s).weighted
        if adjustment.deficient or not adjustment.settled:
            continue
        corrected = corrected_context(context, adjustment)
        relabelled = labelled_sample(sample, corrected)
        if any(now < LEAST_KEPT * before for now, before in zip(_counts(relabelled), _counts(labelled), strict=True)):
            return context
        change = max(label_change(before, relabelled[sensor]) for sensor, before in labelled.items())
        context = replace(corrected, mount=replace(corrected.mount, label_change=change))
        labelled = relabelled
        if context.mbes is not None and (gate_m := _fitting_gate_m(labelled, context)) > context.mount.gate_m:
            context = replace(context, mount=replace(context.mount, gate_m=gate_m))
            labelled, rounds = labelled_sample(sample, context), rounds + 1
    return context


def _fitting_gate_m(labelled: Mapping[str, Stream], context: LabellingContext) -> float:
    (batch,) = labelled["mbes"].batches()  # a sample is one part
    return fitting_gate_m(batch, context)


def label_change(before: Stream, after: Stream) -> float:
    """Return the share of the labels' weight that differs between two labellings of a sample.

    A point that gains or loses its label counts with its weight, one that changes its face with both weights, one that
    comes nearer to an edge with the difference.
    """
    weights = []
    for (batch,) in (before.batches(), after.batches()):  # a sample is one part
        keys = [batch[name] for name in ("t_ns", "beam", "face") if name in batch]
        weights.append(pd.Series(batch["edge_weight"].astype(np.float64)).groupby(keys).sum())
    changed = weights[0].sub(weights[1], fill_value=0.0).abs().sum()
    return float(changed / weights[1].sum())


def _counts(labelled: Mapping[str, Stream]) -> list[int]:
    """Return the number of labelled points of each sensor."""
    return [sum(len(batch["t_ns"]) for batch in stream.batches()) for stream in labelled.values()]


def labelled_sample(sample: Mapping[str, Batch], context: LabellingContext) -> dict[str, Stream]:
    """Return the labelled points of a sample, by sensor; a stream without points has no part."""
    streams = {}
    for source, batch in sample.items():
        for name, columns in label_batch(source, batch, context).streams.items():
            parts = (MemoryPart(name, columns),) if len(columns["t_ns"]) else ()
            streams[SENSOR[name]] = Stream(parts)
    return streams


def corrected_context(context: LabellingContext, adjustment: WeightedIteration) -> LabellingContext:
    """Return the context with the adjusted mount, and the trajectory without drift, relative to the adjusted target.

    Labels are made with the faces as designed. So the adjusted surfaces are brought onto the design: with the
    displacement g = (d, ω) of the surfaces from the design, a point X of the adjusted target is Exp(-ω) (X - d) of the
    designed one.
    """
    state, coarse = adjustment.last.linearisation.state, context.coarse_mount
    g = displacement(state.surfaces, designed_planes(context.model))
    R_design_from_adjusted = exp_so3(-g[3:])
    trajectory = adjustment.last.drift.corrected(context.trajectory)
    mount = replace(
        context.mount,
        rotation_vector_rad=log_so3(state.R_body_from_sensor @ coarse.R_body_from_sensor.T),
        lever_arm_correction_m=state.lever_arm_m - coarse.lever_arm_body_m,
    )
    corrected = trajectory.transformed(R_design_from_adjusted, -R_design_from_adjusted @ g[:3])
    return replace(context, mount=mount, corrected=corrected)
