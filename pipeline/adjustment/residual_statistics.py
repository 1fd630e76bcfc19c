"""Final reading of all points: statistics of the residuals by bin, and a sample of the residuals for the report."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.adjustment.face_errors import with_shared_noise
from pipeline.adjustment.iteration import MountAdjustment
from pipeline.adjustment.observation_model import N_FEATURES, CurrentValues, ObservationModel
from pipeline.adjustment.point_sums import SummedBatch, summed
from pipeline.adjustment.problem import CalibrationProblem
from pipeline.adjustment.residual_places import heights_on_surface, ranges_on_surface
from pipeline.adjustment.residual_tables import residual_sample, residuals_table, sampling_step
from pipeline.adjustment.stored_sums import StoredSums
from pipeline.artefacts.catalogue.results import PATTERNS
from pipeline.artefacts.memory import give_back_memory
from pipeline.artefacts.streams import Batch, Stream, point_array
from pipeline.config.pool import Adjust
from pipeline.gps_time import NS
from pipeline.maths.adjustment.interval_sums import Intervals, IntervalSums
from pipeline.maths.adjustment.mean_tests import normal_deviates
from pipeline.maths.adjustment.parameters import State, kind_of
from pipeline.maths.adjustment.pose_errors import drift_between_passes
from pipeline.maths.adjustment.profiles import (
    FEWEST_BINS,
    PATCHES,
    off_line,
    profile_of,
    profiles_of,
    roughness_allowance,
)
from pipeline.maths.adjustment.residual_means import (
    BinMean,
    BinnedResiduals,
    Comparison,
    ResidualSums,
    bin_means,
    merged_residual_sums,
    residual_sums,
    tested_means,
)
from pipeline.maths.geometry.passes import pass_of
from pipeline.maths.sonar.soundings import receive_angle

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
WIDTHS = {"angle": 2.0, "step": 1.0, "distance": 1.0, "height": 0.1, "time": 10.0}  # of bins: degrees, m, s; else 1
CYCLES = {"ping_2": 2, "ping_3": 3, "ping_4": 4}  # a sonar may change its mode from ping to ping
COMPARED: dict[str, Comparison] = {"pass": "rest", **dict.fromkeys(CYCLES, "rest"), "step": "steps", "height": "steps"}
TURNS = {"turn_x": 3, "turn_y": 4, "turn_z": 5}  # components of the drift
MERGED = 16  # number of batches whose sums are merged: more would only wait in memory
KNOWN = 1e9  # degrees of freedom of a sigma that is not estimated
Row = dict[str, Any]
PassMeans = Mapping[tuple[str, int, int], BinMean]  # key: sensor, surface, pass


@dataclass(frozen=True)
class ResidualStatistics:
    """Mean residuals by sensor, surface and pass; table ``patterns``, means by all bins; table ``residuals``.

    sums_by_face: by sensor, the sums of each interval and face at the adjusted values, for ``final_solution``.
    """

    pass_means: PassMeans
    patterns: pd.DataFrame
    residuals: pd.DataFrame
    sums_by_face: Mapping[str, Intervals]

    def passes_of(self, sensor: str) -> list[int]:
        """Return the numbers of the passes in which a sensor has points."""
        return sorted({number for name, _, number in self.pass_means if name == sensor})

    def count(self, sensor: str, surface: int) -> int:
        """Return the number of a sensor's points on one surface, over all passes."""
        return sum(mean.count for key, mean in self.pass_means.items() if key[:2] == (sensor, surface))


@dataclass(frozen=True)
class _Thinning:
    """Length of a slot of time; step of the sample: every ``step``-th point is in it."""

    slot_ns: int
    step: int


def residual_statistics(
    problem: CalibrationProblem,
    adjustment: MountAdjustment,
    streams: Mapping[str, Stream],
    passes: pd.DataFrame,
    settings: Adjust,
) -> ResidualStatistics:
    """Return statistics and a sample of the residuals at the adjusted values.

    Parameters
    ----------
    problem : CalibrationProblem
        Model, prior information and consider errors of the calibration.
    adjustment : MountAdjustment
        The adjusted values.
    streams : mapping of Stream
        Labelled points by sensor.
    passes : DataFrame
        Table passes.
    settings : Adjust
        Length of a slot of time, and tolerance of the tests.
    """
    give_back_memory()  # the readings before have left holes
    pass_means: dict[tuple[str, int, int], BinMean] = {}
    patterns: list[Row] = []
    samples: list[Batch] = []
    sums_by_face: dict[str, StoredSums] = {}
    families = [surface.family for surface in adjustment.state.surfaces]
    for sensor, stream in streams.items():
        step = sampling_step(adjustment.accumulation.observations(sensor))
        thinning = _Thinning(round(settings.moment_s * NS), step)
        pieces: dict[str, list[ResidualSums]] = {}
        read = stream.fold(_batch, problem.model, sensor, adjustment.values, thinning)
        by_face = _kept(read, pieces, samples)
        sums_by_face[sensor] = StoredSums.of(by_face, N_FEATURES[kind_of(sensor)])
        give_back_memory()
        of_surface, of_face = _allowances(problem, adjustment, sensor, pieces.get("height", []))
        for variable, parts in pieces.items():
            sums = merged_residual_sums(parts)
            if variable == "pass":
                pass_means |= {(sensor, *mean.key): mean for mean in bin_means(sums)}
            names = problem.model.faces.names if variable == "height" else families
            compared = COMPARED.get(variable, "bins")
            allowed_m = of_face if variable == "height" else of_surface
            # a pass is compared with others of the same wall, which is as rough to them
            tolerated = settings.test_tolerance_m + (0.0 * allowed_m if compared == "rest" else allowed_m)
            tested = tested_means(sums, compared)
            patterns += [
                _row(variable, sensor, names[mean.key[0]], mean) | {"tolerated_m": tolerated[mean.key[0]]}
                for mean in tested
            ]
    patterns += _drift_rows(problem, adjustment, passes)
    return ResidualStatistics(
        pass_means=pass_means,
        patterns=_patterns_table(patterns),
        residuals=residuals_table(samples),
        sums_by_face=with_shared_noise(problem, adjustment, sums_by_face),
    )


def _allowances(
    problem: CalibrationProblem, adjustment: MountAdjustment, sensor: str, heights: list[ResidualSums]
) -> tuple[Array, Array]:
    """Return what a mean residual on each surface (s,), and at a height of each face (f,), may be larger by, m.

    It is zero but for walls that nobody has surveyed, which may be rough; ``heights``: sums by face and height.
    """
    faces, rough = problem.model.faces, adjustment.rough.get(sensor)
    if rough is None:
        return np.zeros(len(adjustment.state.surfaces)), np.zeros(len(faces.names))
    of_surface = PATCHES * rough.patch_m
    of_face = of_surface[faces.surface]
    for face, means in profiles_of(heights).items():
        if len(means) >= FEWEST_BINS:
            number, value, _ = profile_of(means)
            of_face[face] = roughness_allowance(float(rough.patch_m[faces.surface[face]]), off_line(number, value))
    np.maximum.at(of_surface, faces.surface, of_face)
    return of_surface, of_face


def _kept(
    read: Iterator[tuple[dict[str, ResidualSums], IntervalSums, Batch]],
    pieces: dict[str, list[ResidualSums]],
    samples: list[Batch],
) -> Iterator[IntervalSums]:
    """Yield the sums by interval and face of each batch; add its other sums and its sample to the lists."""
    for by_variable, by_face, sample in read:
        samples.append(sample)
        for variable, sums in by_variable.items():
            parts = pieces.setdefault(variable, [])
            parts.append(sums)
            if len(parts) == MERGED:
                parts[:] = [merged_residual_sums(parts)]
        yield by_face


def _batch(
    batch: Batch, model: ObservationModel, sensor: str, values: CurrentValues, thinning: _Thinning
) -> tuple[dict[str, ResidualSums], IntervalSums, Batch]:
    """Return the sums of one batch by variable, its sums by interval and face, and a sample of its residuals."""
    observed = summed(batch, model, sensor, values, residuals=True)
    # plain weights, without robust reduction: a bin with large residuals must show, not lose its weight
    v_m, _, _, plain, normalised, _ = observed.observed
    slot = observed.points["t_ns"] // thinning.slot_ns
    sums = {}
    face = observed.points["face"].astype(np.int64)
    upright = np.flatnonzero(~np.array([surface.level for surface in values.state.surfaces])[observed.surface])
    for variable, column in _variables(model, sensor, observed, values.state):
        use = upright if variable == "height" else slice(None)
        residuals = BinnedResiduals(
            first=(face if variable == "height" else observed.surface)[use],
            second=np.floor(column / WIDTHS.get(variable, 1.0)).astype(np.int64)[use],
            slot=slot[use],
            weight=plain[use],
            v_m=v_m[use],
            normalised=normalised[use],
        )
        sums[variable] = residual_sums(residuals)
    return sums, observed.sums, residual_sample(model, sensor, observed, values.state, thinning.step)


def _variables(
    model: ObservationModel, sensor: str, observed: SummedBatch, state: State
) -> Iterator[tuple[str, Array | Integers]]:
    """Yield each variable by which residuals are binned: its name, and its values (n,) for the points.

    Distance and height above the water are those of the place where the ray meets the surface
    (:mod:`~pipeline.adjustment.residual_places`).

    A step at a height tells what disturbs a sensor near the water, or where a face ends. Each face is compared with
    itself, because faces end at different heights. On a level face the height is that of the drift; it has no test.
    """
    batch, own = observed.points, point_array(observed.points, f"{kind_of(sensor)}_m")
    range_m, reached_m = ranges_on_surface(sensor, observed)
    angle = np.degrees(np.arcsin(own[:, 2] / range_m) if sensor == "laser" else receive_angle(own))
    yield "pass", batch["pass"].astype(np.int64)
    yield "face", batch["face"].astype(np.int64)
    yield "angle", angle
    yield "distance", reached_m
    yield "height", heights_on_surface(model, sensor, observed, state)
    yield "time", batch["t_ns"] // NS
    if kind_of(sensor) == "mbes":
        yield "step", angle
        for name, pings in CYCLES.items():
            yield name, batch["ping"] % pings


def _row(variable: str, sensor: str, family: str, mean: BinMean) -> Row:
    width = WIDTHS.get(variable, 1.0)
    return {
        "by": variable,
        "sensor": sensor,
        "family": family,
        "low": mean.key[1] * width,
        "width": width,
        "count": mean.count,
        "mean_m": mean.mean_m,
        "sigma_mean_m": mean.sigma_mean_m,
        "dof": mean.dof,
    }


def _drift_rows(problem: CalibrationProblem, adjustment: MountAdjustment, passes: pd.DataFrame) -> list[Row]:
    """Return rows of ``patterns``: turn of the boat by the drift in each pass, less that in the other passes, rad.

    (Shifts by the drift are not tested: they move both sensors alike, so they only show errors of the INS.)
    """
    drift = adjustment.drift
    recorded, record = problem.model.body.trajectory, drift.knots.record
    t_ns, ahead = recorded.t_ns[record], recorded.R_frame_from_body[record, :, 1]
    pass_of_knot = pass_of(t_ns, passes["start_ns"].to_numpy(), passes["end_ns"].to_numpy()).astype(np.int64)
    bow = np.arctan2(ahead[:, 1], ahead[:, 0])
    by_pass = drift_between_passes(drift, problem.prior.noise, pass_of_knot, bow)
    return [
        {"by": "drift", "sensor": "ins", "family": name, "low": float(number), "width": 1.0}
        | {"count": int(np.sum(pass_of_knot == number))}
        | {"mean_m": difference[k], "sigma_mean_m": sigma[k], "dof": KNOWN, "tolerated_m": 0.0}
        for number, difference, sigma in zip(by_pass.passes, by_pass.difference, by_pass.sigma, strict=True)
        for name, k in TURNS.items()
        if sigma[k] > 0
    ]


def _patterns_table(rows: list[Row]) -> pd.DataFrame:
    table = pd.DataFrame(rows, columns=[column.name for column in PATTERNS.columns])
    figures = (table[name].to_numpy(np.float64) for name in ("mean_m", "sigma_mean_m", "dof", "tolerated_m"))
    return table.assign(normalised=normal_deviates(*figures))
