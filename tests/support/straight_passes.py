"""Soundings of straight passes from a forward model of their own, as lifted moments with a wrong coarse mount."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from pipeline.maths.geometry.planes import Plane, PlaneMoments, fit_plane
from pipeline.maths.patent.angles import PassPlanes, fourth_normal
from pipeline.maths.patent.lifted_moments import lift
from pipeline.maths.patent.offsets import DryFace, PassOffsets, WetFace
from tests.support.targets import by_letters, members

Array = NDArray[np.float64]
UNTURNED = np.eye(3)
DRY = [DryFace("P1-5-top", 1.5, 1.5, 1000), DryFace("P3-5-top", 2.0, 2.0, 1000)]


class StraightPass(NamedTuple):
    """A pass: both sensors' observations, and the mounts it was made with."""

    observed: PassOffsets
    wet: list[WetFace]
    lever_arm_m: Array
    R_coarse: Array
    R_true: Array
    laser: dict[str, Plane]


def normals_of(turn: Array = UNTURNED) -> dict[str, Array]:
    """Outward normals of P1 to P4, turned together."""
    root = np.sqrt(0.5)
    n = {"P1": [-root, -root, 0], "P2": [-1, 0, 0], "P3": [-root, root, 0]}
    found = {name: turn @ np.array(v) for name, v in n.items()}
    return found | {"P4": fourth_normal(found["P1"], found["P2"])}


def straight_pass(
    distance: float,
    number: int,
    mount_error: ArrayLike,
    lever_error: ArrayLike,
    swing_deg: float = 0.0,
    azimuth: float = 0.0,
    noise: float = 0.0,
) -> StraightPass:
    """A pass along +y at x = -distance: soundings on the faces, generated from the truth; and the laser's planes.

    The forward model is its own: for each ping the fan's plane is cut with the faces in the target frame, and the
    sonar coordinates follow by inverting the *true* mount. The lifted features then use the wrong, coarse mount.
    """
    rng = np.random.default_rng(number)
    model = by_letters(8.0, 3.0, 1.0, 0.5)
    R_true = Rotation.from_euler("ZXY", np.radians([-2.0, 1.2, -48.8])).as_matrix()
    lever_true = np.array([0.3, 0.2, -2.0])
    R_coarse = Rotation.from_rotvec(-np.asarray(mount_error)).as_matrix() @ R_true
    turn = Rotation.from_euler("z", azimuth).as_matrix()  # of the target in the frame that "body" is aligned with
    lifted: dict[str, Any] = {}
    laser: dict[str, Plane] = {}
    heights: dict[str, float] = {}
    for face in model.faces:
        inside = face.vertices_m[:, 2].max() < -0.5 or face.family == "P2"
        if not inside or face.normal[2] < 0:
            continue
        w = rng.dirichlet(np.ones(len(face.vertices_m)), 300)
        points = w @ face.vertices_m
        points = points[points[:, 2] < -0.5]
        # When is a point seen? When the fan's plane (normal: the mbes y axis) passes through it.
        y = points[:, 1].copy()
        for _ in range(30):
            heading = np.radians(swing_deg) * np.sin(0.9 * y + number)
            roll = np.radians(1.0) * np.sin(2.1 * y)
            T = Rotation.from_euler("ZXY", np.column_stack([heading, 0.2 * roll, roll])).as_matrix()
            p = np.column_stack([np.full_like(y, -distance) + 0.05 * np.sin(y), y, np.full_like(y, 1.3)])
            body = np.einsum("nji,nj->ni", T, points - p)
            mbes = (body - lever_true) @ R_true
            y = y + mbes[:, 1] / (T @ R_true)[:, 1, 1]
        assert np.abs(mbes[:, 1]).max() < 1e-9
        mbes[:, [0, 2]] += rng.normal(scale=noise, size=(len(mbes), 2)) if noise else 0.0
        features = lift(turn @ T, p @ turn.T, mbes @ R_coarse.T)
        key = face.family if face.family != "H" else face.name
        lifted[key] = lifted.get(key, 0) + features.T @ features
        heights[face.name] = face.vertices_m[0, 2]
    for family in ("P1", "P2", "P3"):
        dry = np.concatenate([model.faces[k].vertices_m + np.array([0, 0, 4.0]) for k in members(model, family)])
        laser[family] = fit_plane(PlaneMoments.of(dry @ turn.T), turn @ model.faces[members(model, family)[0]].normal)
    normals = {name: plane.normal for name, plane in laser.items()}
    normals["P4"] = fourth_normal(normals["P1"], normals["P2"])
    one = PassPlanes(number, {f: lifted[f] for f in ("P1", "P2", "P3")}, normals)
    wet = [WetFace(name, m, heights[name]) for name, m in lifted.items() if name.endswith("top")]
    observed = PassOffsets(one, laser["P2"], laser["P1"])
    return StraightPass(observed, wet, lever_true - np.asarray(lever_error), R_coarse, R_true, laser)


def several(
    mount_error: ArrayLike, lever_error: ArrayLike, azimuth: float = 0.0, swing_deg: float = 1.5
) -> tuple[list[PassOffsets], list[WetFace], Array]:
    """Passes at three distances, their wet faces, and the coarse lever arm."""
    made = [straight_pass(d, k, mount_error, lever_error, swing_deg, azimuth) for k, d in enumerate((4.0, 7.5, 5.5))]
    return [one for one, *_ in made], [face for _, wet, *_ in made for face in wet], made[0][2]
