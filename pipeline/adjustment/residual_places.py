"""Places where the rays of a batch meet their surfaces: their distances from the sensor, and their heights.

By the measured range the noise would choose the bin of a residual: of a wall that begins at 4.0 m, only points that are
measured too near lie below 4 m. On bottoms the cosine n · d is positive: their family's normal is that of the tops.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.observation_model import ObservationModel
from pipeline.adjustment.point_sums import SummedBatch
from pipeline.artefacts.streams import Batch, point_array
from pipeline.maths.adjustment.design_matrix import FLATTEST
from pipeline.maths.adjustment.parameters import State, kind_of

Array = NDArray[np.float64]


def ranges_on_surface(sensor: str, observed: SummedBatch) -> tuple[Array, Array]:
    """Return the measured ranges (n,) m, and those to the surface; ``observed`` has residuals."""
    v_m, cosine = observed.observed[0], observed.observed[-1]
    own = point_array(observed.points, f"{kind_of(sensor)}_m")
    range_m = np.sqrt(own[:, 0] ** 2 + own[:, 1] ** 2 + own[:, 2] ** 2)
    return range_m, range_m - v_m / np.copysign(np.maximum(np.abs(cosine), FLATTEST), cosine)


def heights_on_surface(model: ObservationModel, sensor: str, observed: SummedBatch, state: State) -> Array:
    """Return the heights (n,) m above the water of the places where the rays meet the surface.

    The sensor's height between two records is linear in time here: to a millimetre, where a bin is a decimetre.
    """
    range_m, reached_m = ranges_on_surface(sensor, observed)
    points, body, record = observed.points, model.body, observed.record
    is_calibrated = sensor in state.heads
    measured = model.points_in_target(sensor, points, state)[:, 2] if is_calibrated else points["z_target_m"]
    lever_arm = body.lever_arm(sensor, state)
    used = slice(int(record.min(initial=0)), int(record.max(initial=0)) + 2)
    at_records = body.trajectory.positions_m[used, 2] + body.trajectory.R_frame_from_body[used, 2] @ lever_arm
    before, after = (at_records[record - used.start + k] for k in (0, 1))
    start = before + observed.share * (after - before)
    return np.asarray(start + reached_m / range_m * (measured - start) - model.wet_heights_m[1])


def places_on_surface(model: ObservationModel, sensor: str, points: Batch, state: State) -> Array:
    """Return the places (n, 3) m, target frame, where the rays of labelled points meet their surfaces; no drift."""
    calibrated = sensor in state.heads
    placed = model.points_in_target(sensor, points, state) if calibrated else point_array(points, "target_m")
    ray = placed - model.body.trajectory.track_of_point(points["t_ns"], model.body.lever_arm(sensor, state))
    number = model.faces.surface[points["face"]]
    normal = np.array([surface.normal for surface in state.surfaces])[number]
    distance_m = np.array([surface.distance_m for surface in state.surfaces])[number]
    off_m = np.einsum("ni,ni->n", placed, normal) - distance_m - model.height_of_face[points["face"]]
    approach = np.einsum("ni,ni->n", ray, normal)
    beyond = off_m / np.where(np.abs(approach) > 1e-3, approach, np.inf)
    return np.asarray(placed - beyond[:, None] * ray)
