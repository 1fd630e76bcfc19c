"""Measure the compiled loops, one core each, on points of a run: million points a second, against other ways.

* numpy: the form that the loop's test compares it with;
* copy: copying the memory that the loop reads and writes, which no loop can beat;
* Open3D's plane segmentation (RANSAC) on the same points, which finds one plane where labels name the face of each.

All figures are medians of rounds in turn, so that a slow minute of the machine slows every way. PDAL, whose stage
filters.georeference places points too, is not measured: no package of it brings its library.

    python -m tools.bench_kernels RUN
"""

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.observation_model import CurrentValues, ObservationModel
from pipeline.adjustment.point_sums import summed
from pipeline.artefacts.catalogue.points import POSES
from pipeline.artefacts.catalogue.target import LASER_LABELLED, SOUNDINGS_LABELLED, TARGET_POSE
from pipeline.artefacts.from_tables import trajectory_in_target
from pipeline.artefacts.schema import Artefact
from pipeline.artefacts.streams import Batch, point_array
from pipeline.maths.adjustment.weighting import Weighting
from pipeline.maths.target.beams import TargetBeams
from pipeline.maths.target.labelling import LabelSettings, label_points
from pipeline.mount import mount_of
from pipeline.run.results import Tables
from pipeline.run.settings import read_settings
from pipeline.target.design import target_of
from tests.support.label_oracle import label_points_by_numpy
from tests.support.placing_oracle import placed_by_numpy
from tools.bench_model import observation_model

ROUNDS = 5
LIMITS = LabelSettings(0.05, 0.03, np.radians(5), lowest_m=0.05, spot_m=0.004, ramp_m=0.03, seen="dry")
Way = Callable[[], object]


def rates(points: int, ways: dict[str, Way]) -> dict[str, float]:
    """Return million points a second of each way."""
    spent: dict[str, list[float]] = {name: [] for name in ways}
    for way in ways.values():
        way()  # compiles or loads, and touches the memory
    for _ in range(ROUNDS):
        for name, way in ways.items():
            start = time.process_time()
            way()
            spent[name].append(time.process_time() - start)
    return {name: points / statistics.median(seconds) / 1e6 for name, seconds in spent.items()}


def copying(*arrays: NDArray[np.generic]) -> Way:
    """Return a way that copies these arrays."""
    targets = [np.empty_like(array) for array in arrays]

    def copy() -> None:
        for target, array in zip(targets, arrays, strict=True):
            np.copyto(target, array)

    return copy


def largest_batch(tables: Tables, artefact: Artefact) -> Batch:
    """Return the first of the stream's longest batches."""
    return max(tables.stream(artefact).batches(), key=lambda batch: len(batch["t_ns"]))


def placing(tables: Tables, batch: Batch) -> dict[str, float]:
    """Measure how points of the laser are placed in the target frame."""
    trajectory = trajectory_in_target(tables.table(POSES), tables.table(TARGET_POSE))
    mount = mount_of(read_settings(tables.run).session.laser.mount)
    t_ns, points = batch["t_ns"], point_array(batch, "laser_m")
    M, lever_arm_m = mount.R_body_from_sensor, mount.lever_arm_body_m
    return rates(
        len(t_ns),
        {
            "compiled": lambda: trajectory.points_from_sensor(t_ns, points, M, lever_arm_m),
            "numpy": lambda: placed_by_numpy(trajectory, t_ns, points @ M.T + lever_arm_m),
            "copy": copying(t_ns, points, points),
        },
    )


def labelling(tables: Tables, batch: Batch) -> dict[str, float]:
    """Measure the labels of laser points, of which a fifth lies off the target."""
    model = target_of(read_settings(tables.run).pool.target)
    random, points = np.random.default_rng(1), point_array(batch, "target_m")
    points = points + np.where(random.random((len(points), 1)) < 0.2, random.normal(0, 1, points.shape), 0.0)
    points = np.asfortranarray(points)  # axis by axis, as streams have them
    trajectory = trajectory_in_target(tables.table(POSES), tables.table(TARGET_POSE))
    lever_arm_m = mount_of(read_settings(tables.run).session.laser.mount).lever_arm_body_m
    beams = TargetBeams.from_origins(trajectory.track_of_point(batch["t_ns"], lever_arm_m), points)
    labels = label_points(model, points, beams, LIMITS)
    written = (labels.face, labels.cos_incidence, labels.edge_weight)
    return rates(
        len(points),
        {
            "compiled": lambda: label_points(model, points, beams, LIMITS),
            "numpy": lambda: label_points_by_numpy(model, points, beams, LIMITS),
            "copy": copying(points, beams.directions, beams.ranges_m, *written),
            "Open3D segment_plane": _plane_by_open3d(points),
        },
    )


def _plane_by_open3d(points: NDArray[np.float64]) -> Way:
    import open3d as o3d

    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    o3d.utility.random.seed(0)
    return lambda: cloud.segment_plane(distance_threshold=0.03, ransac_n=3, num_iterations=100)


def accumulating(model: ObservationModel, sensor: str, batch: Batch) -> dict[str, float]:
    """Measure the sums of points for the normal equations, with robust weights."""
    values = CurrentValues(model.coarse, weighting=Weighting(robust=(3.0, 6.0)))

    def by_numpy() -> None:
        observations = model.linearise(sensor, batch, values)
        observations.sums(values.weighting.weights(observations)[1])

    return rates(
        len(batch["t_ns"]),
        {
            "compiled": lambda: summed(batch, model, sensor, values),
            "numpy": by_numpy,
            "copy": copying(*batch.values()),
        },
    )


def kernels(run: Path) -> str:
    """Return the rates as a Markdown table."""
    tables = Tables(run)
    laser, soundings = (largest_batch(tables, artefact) for artefact in (LASER_LABELLED, SOUNDINGS_LABELLED))
    model = observation_model(run)
    found = {
        "placing laser points": placing(tables, laser),
        "labelling laser points": labelling(tables, laser),
        "accumulating laser points": accumulating(model, "laser", laser),
        "accumulating soundings": accumulating(model, "mbes", soundings),
    }
    ways = ("compiled", "numpy", "copy", "Open3D segment_plane")
    lines = ["| million points a second, one core | " + " | ".join(ways) + " |", "|---|" + "---:|" * len(ways)]
    for name, rate in found.items():
        lines.append(f"| {name} | " + " | ".join(f"{rate[way]:.1f}" if way in rate else "" for way in ways) + " |")
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, metavar="RUN", help="a run folder")
    print(kernels(parser.parse_args().run))


if __name__ == "__main__":
    main()
