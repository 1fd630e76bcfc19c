"""The gate of the soundings, wide enough for the noise on each family of faces.

The search for the mount takes the gate from the scatter of all soundings, most of which lie on the front. On other
faces the noise may be many times as large: a wide footprint on a face at 45°, a rough face, weed. A gate narrower than
such noise cuts it off on both sides, *where the provisional mount places the face*. What remains has its mean near
there whatever the mount, and draws the result to it: with a gate of ±1.1 sigmas on the slanted faces by 0.25° and
15 mm, at sigmas a sixth of that.

With normal noise of sigma σ and a gate of k σ, half of the absolute values are below m,

    Φ(m / σ) - 1/2 = (Φ(k) - 1/2) / 2,

so that m over the gate, Φ⁻¹(1/4 + Φ(k) / 2) / k, falls from 1/2 for a narrow gate to 0.67 / k for a wide one. From the
median it gives k, and σ.
"""

from dataclasses import replace

import numpy as np

from pipeline.artefacts.streams import Batch, point_array
from pipeline.config.stage_settings import FacesAsBuilt
from pipeline.maths.target.model import TargetModel
from pipeline.target.labelled_points import LabellingContext
from pipeline.target.matching import GATE_SCALES, planes_of_faces
from pipeline.target.search_results import ProvisionalMount

WET_SIGMAS = 4.0  # of a wet face's place and of the noise together: two faces may be off to different sides
LEAST_SIGMAS = 3.0  # a narrower gate, in sigmas of a family's noise, cuts it off
NARROWEST, WIDEST = 0.5, 1000.0  # gates in sigmas that can be told from narrower and wider ones
FEWEST = 50  # soundings of a family whose noise is trusted
SHARE_OF_PERIOD = 0.5  # widest gate as a share of half the period: near the middle between parallel faces


def for_uncertain_faces(mount: ProvisionalMount, as_built: FacesAsBuilt, model: TargetModel) -> ProvisionalMount:
    """Return the provisional mount with a gate that takes in wet faces that may stand off the dry ones.

    A wall that nobody has surveyed below the water may be off by centimetres, about the gate itself. Cut off at the
    gate, its soundings would have their mean where the wall is believed to stand.
    """
    if not np.isfinite(mount.scale_m):
        return mount
    lean_m = np.radians(as_built.angle_sigma_deg) * model.depth_m / 2
    sigmas_m = [as_built.offset_sigma_m, as_built.growth_sigma_m, lean_m, mount.scale_m]
    reach_m = WET_SIGMAS * float(np.linalg.norm(sigmas_m))
    return replace(mount, gate_m=max(mount.gate_m, min(reach_m, SHARE_OF_PERIOD * model.half_period_m)))


def fitting_gate_m(labelled: Batch, context: LabellingContext) -> float:
    """Return the gate (m) that leaves the noise of every family whole: the context's, or a wider one.

    Parameters
    ----------
    labelled
        Rows of the stream ``soundings_labelled``.
    context
        The provisional mount, its gate, and the corrected trajectory.
    """
    gate_m = context.mount.gate_m
    sigma_m = sigma_through_gate(_largest_median(labelled, context), gate_m)
    if gate_m >= LEAST_SIGMAS * sigma_m:
        return gate_m
    return max(gate_m, min(GATE_SCALES * sigma_m, SHARE_OF_PERIOD * context.model.half_period_m))


def sigma_through_gate(median_m: float, gate_m: float) -> float:
    """Return the sigma (m) of normal noise by the median of its absolute values within a gate."""
    from scipy.optimize import brentq
    from scipy.special import ndtr, ndtri

    def excess(k: float) -> float:
        return float(ndtri(0.25 + ndtr(k) / 2) / k) - median_m / gate_m

    if excess(NARROWEST) <= 0:
        return gate_m / NARROWEST
    return gate_m / (WIDEST if excess(WIDEST) >= 0 else float(brentq(excess, NARROWEST, WIDEST)))


def _largest_median(labelled: Batch, context: LabellingContext) -> float:
    """Return the median distance (m) of soundings from their faces, of the family that has the largest.

    It is about zero: faces that are not where they should be count, too.
    """
    mount, faces = context.provisional_mount, context.model.faces
    body = point_array(labelled, "mbes_m") @ mount.R_body_from_sensor.T + mount.lever_arm_body_m
    points = context.corrected.points_from_body(labelled["t_ns"], body)
    number, planes = labelled["face"].astype(np.int64), planes_of_faces(context.model)
    off_m = np.abs(np.einsum("ni,ni->n", points, planes.normals[number]) - planes.distances_m[number])
    families = np.array([face.family for face in faces])[number]
    names, counts = np.unique(families, return_counts=True)
    return float(max((np.median(off_m[families == name]) for name in names[counts >= FEWEST]), default=0.0))
