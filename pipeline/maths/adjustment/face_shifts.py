"""Shifts of single faces against their surface, as further parameters of the normal equations.

The faces of a family share one surface. As built, each stands off it by an error of its own, along its normal, and both
sensors see it there. The iteration does without these parameters: they are many, and are fixed at what the survey says.
The last normal equations have them, because their errors enter the total covariance, and each is tested.

A shift b of face j, outward, changes v by -s b for points on this face and by nothing for others, where s is +1 if the
face looks along the normal of its family, -1 if it looks the other way. So the sums of intervals must be those of
single faces: sums of a surface do not tell which of its points lie on which face.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.maths.adjustment.eliminate_drift import NormalEquations, eliminate_drift
from pipeline.maths.adjustment.eliminate_white_noise import LinearisedIntervals, TimeAxis, eliminate_white_noise
from pipeline.maths.adjustment.normal_equations import Linearisation, SurfaceIntervals
from pipeline.maths.adjustment.pose_errors import DriftEstimate, PoseNoise

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Faces:
    """The target's faces: names; surface (f,): number of the surface of each; sense (f,): s, +1 or -1."""

    names: tuple[str, ...]
    surface: Integers
    sense: Array

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters that are their shifts."""
        return tuple(f"face_{name}" for name in self.names)


@dataclass(frozen=True)
class _FaceIntervals:
    """One sensor's intervals on one face; ``column``: number of the face's shift among all parameters."""

    on_surface: SurfaceIntervals
    column: int
    sense: float

    @property
    def record(self) -> Integers:
        return self.on_surface.record

    def linearised(self, rows: slice) -> LinearisedIntervals:
        """Return the intervals in these rows, with their designs."""
        intervals = self.on_surface.linearised(rows)
        of_face = np.zeros_like(intervals.design[:, :, :1])
        of_face[:, 0] = -self.sense
        design = np.concatenate([intervals.design, of_face], axis=2)
        return replace(intervals, design=design, columns=np.append(intervals.columns, self.column))


def equations_with_faces(
    linearisation: Linearisation, faces: Faces, drift: DriftEstimate, noise: PoseNoise
) -> NormalEquations:
    """Return the normal equations of all u parameters and, after them, of the shifts of f faces.

    Parameters
    ----------
    linearisation : Linearisation
        Sums by interval and face (``surface`` is the number of the face), and the values at which they were taken.
    faces : Faces
        The target's faces.
    drift : DriftEstimate
        The drift with which the observations were taken.
    noise : PoseNoise
        Standard deviations of the pose errors.
    """
    size, times = linearisation.state.size, TimeAxis(linearisation.body.seconds, drift.knots)
    seen = np.unique(np.concatenate([sums.surface for sums in linearisation.sums.values()]))  # only these have a column
    together = np.zeros(len(drift.knots.inner), dtype=np.int64)
    sources = list(_by_face(linearisation, faces, seen))
    reduced = eliminate_white_noise(sources, size + len(seen), times, noise.white, together, linearisation.mapper)
    equations = eliminate_drift(reduced.of([0]), noise, drift)
    count, places = size + len(faces.names), np.concatenate([np.arange(size), size + seen])
    normal, right = np.zeros((count, count)), np.zeros(count)
    normal[np.ix_(places, places)], right[places] = equations.normal, equations.right
    return replace(equations, normal=normal, right=right)


def _by_face(linearisation: Linearisation, faces: Faces, seen: Integers) -> Iterator[_FaceIntervals]:
    for sensor, sums in linearisation.sums.items():
        for face in np.unique(sums.surface).tolist():
            rows = np.flatnonzero(sums.surface == face)
            on_surface = SurfaceIntervals(
                linearisation=linearisation,
                sensor=sensor,
                surface=int(faces.surface[face]),
                rows=rows,
                record=sums.record[rows],
                selected=None,
            )
            column = linearisation.state.size + int(np.searchsorted(seen, face))
            yield _FaceIntervals(on_surface, column, float(faces.sense[face]))
