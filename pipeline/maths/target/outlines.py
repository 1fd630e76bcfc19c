"""The target's model from the outlines of its faces and the relations between them.

The relations *same_plane*, *distance* (parallel, as far apart as their corners) and *height* (the same for horizontal
faces) make one family of the faces that they name. *parallel* leaves the distance open and ties families.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import ConfigError
from pipeline.maths.target.face import HORIZONTAL_COSINE, TOUCH_M, Face, Mask, plane_of
from pipeline.maths.target.masks import MOST_LEVEL
from pipeline.maths.target.model import ROLES, Family, TargetModel, names_in_order

Array = NDArray[np.float64]
Kind = Literal["same_plane", "distance", "height", "parallel"]
FLAT_M = 0.01  # corners farther than this off their own plane make no plane
SAME_PLANE_M = 0.02  # faces of one plane may stand this far apart by their corners
PARALLEL_DEG = 0.5  # parallel faces may be turned by this by their corners
AWAY = 0.1  # largest x of an upright face's normal: the boat passes at x < 0
ACROSS_M = 3.0  # a face that stands all of this before x = 0 may look toward +x: the boat passes between
SMALLEST_M = 0.05  # a face smaller than the square of this side is refused


@dataclass(frozen=True)
class Outline:
    """A face with its corners (k, 3) m, counter-clockwise as the sensors see them; ``seen``, ``masks_m`` as in Face."""

    name: str
    corners: Sequence[Sequence[float]]
    role: str = ""
    seen: str = "both"
    masks_m: tuple[Mask, ...] = ()


@dataclass(frozen=True)
class Relation:
    """A relation between faces; ``name`` is the name of their family (empty: the role, or made from a face's name)."""

    kind: Kind
    faces: tuple[str, ...]
    name: str = ""


def build_target(
    outlines: Sequence[Outline], relations: Sequence[Relation], water_level_m: float, repeats_m: float | None
) -> TargetModel:
    """Build the model of a target from the outlines of its faces and the relations between them.

    Parameters
    ----------
    outlines
        Faces, target frame.
    relations
        Known relations between the planes of the faces.
    water_level_m
        Height of the water, target frame.
    repeats_m
        Height after which the shape repeats; None if it does not.

    Raises
    ------
    ConfigError
        Corners that make no convex polygon, or relations that the corners contradict.
    """
    planes = {outline.name: _plane(outline) for outline in outlines}
    for relation in relations:
        _check(relation, planes)
    order = [outline.name for outline in outlines]
    roles = {outline.name: outline.role for outline in outlines if outline.role}
    families = [_family(members, relations, planes, roles, order) for members in _groups(order, relations)]
    _refuse_double_names([family.name for family in families])
    by_face = {outlines[number].name: family for family in families for number in family.faces}
    faces = []
    for outline in outlines:
        normal, distance_m = planes[outline.name]
        family = by_face[outline.name]
        sense = float(np.sign(normal @ family.normal))
        face = Face(
            name=outline.name,
            family=family.name,
            normal=normal,
            distance_m=distance_m,
            vertices_m=np.array(outline.corners, dtype=np.float64),
            sense=sense,
            offset_m=0.0 if family.one_plane else sense * distance_m - family.distance_m,
            seen=outline.seen,
            masks_m=outline.masks_m,
        )
        faces.append(face)
    faces = _with_corners(faces)
    pairs = [
        (by_face[relation.faces[0]].name, by_face[other].name)
        for relation in relations
        if relation.kind == "parallel"
        for other in relation.faces[1:]
    ]
    parallel = tuple(dict.fromkeys(pair for pair in pairs if pair[0] != pair[1]))
    return TargetModel(tuple(faces), names_in_order(families), parallel, water_level_m, repeats_m)


def _with_corners(faces: Sequence[Face]) -> list[Face]:
    """Return the faces with their creases, the lines along which other faces meet them, and their outer edges.

    Only faces whose bounding boxes touch are tried.
    """
    low = np.array([face.vertices_m.min(axis=0) for face in faces]) - TOUCH_M
    high = np.array([face.vertices_m.max(axis=0) for face in faces]) + TOUCH_M
    touch = np.all((low[:, None] <= high[None]) & (low[None] <= high[:, None]), axis=2)
    found = []
    for face, touching in zip(faces, touch, strict=True):
        others = [faces[number] for number in np.flatnonzero(touching).tolist()]
        creases_m = tuple(line for line in map(face.meets, others) if line is not None)
        outer = np.any([face.turns_away(other) for other in others], axis=0)
        found.append(replace(face, creases_m=creases_m, outer_edges=tuple(outer.tolist())))
    return found


def _plane(outline: Outline) -> tuple[Array, float]:
    """Return normal and distance of a face; refuse corners that do not make a convex polygon visible from the boat."""
    vertices = np.array(outline.corners, dtype=np.float64)
    where = f"target.faces.{outline.name}: corners"
    after = np.roll(vertices, -1, axis=0)
    area = np.linalg.norm(np.cross(vertices - vertices[0], after - vertices[0]).sum(axis=0)) / 2
    if area < SMALLEST_M**2:
        raise ConfigError(f"{where}: they enclose {area:.4f} m²: give a polygon's corners one after another")
    normal, distance_m = plane_of(vertices)
    off = float(np.max(np.abs(vertices @ normal - distance_m)))
    if off > FLAT_M:
        raise ConfigError(f"{where}: {1000 * off:.0f} mm off their own plane; measure them again, or make two faces")
    turns = np.cross(after - vertices, np.roll(after, -1, axis=0) - after) @ normal
    if np.any(turns <= 0):
        raise ConfigError(f"{where}: make no convex polygon; split the face into convex ones, tied by same_plane")
    if outline.masks_m and abs(normal[2]) > MOST_LEVEL:
        raise ConfigError(
            f"target.faces.{outline.name}.masks: a level face has no left and right, and one height; leave the part "
            "out of its corners"
        )
    if looks_away(vertices, normal):
        raise ConfigError(
            f"{where}: the face looks away from the boat, which passes at x < 0; give its corners counter-clockwise as "
            "seen from the boat"
        )
    return normal, distance_m


def looks_away(vertices_m: Array, normal: Array) -> bool:
    """Return whether a boat at x < 0 cannot see an upright face; it may pass before one that stands across from x = 0.

    Parameters
    ----------
    vertices_m
        Corners (k, 3), target frame.
    normal
        Outward normal (3,).
    """
    upright = abs(normal[2]) <= HORIZONTAL_COSINE
    return bool(upright and normal[0] > AWAY and vertices_m[:, 0].max() > -ACROSS_M)


def _check(relation: Relation, planes: Mapping[str, tuple[Array, float]]) -> None:
    """Refuse a relation that the corners contradict."""
    where = f"target.relations: {relation.kind}: {', '.join(relation.faces)}"
    for name in relation.faces:
        if name not in planes:
            known = ", ".join(planes)
            raise ConfigError(f"{where}: {name!r} is no face of this target; its faces are {known}")
    first, distance_m = planes[relation.faces[0]]
    for name in relation.faces[1:]:
        normal, other_m = planes[name]
        sense = 1.0 if normal @ first > 0 else -1.0
        angle = float(np.degrees(np.arcsin(min(1.0, float(np.linalg.norm(np.cross(first, normal)))))))
        if angle > PARALLEL_DEG:
            raise ConfigError(f"{where}: {name} is turned by {angle:.2f}° against {relation.faces[0]}: not parallel")
        if relation.kind == "same_plane" and (sense < 0 or abs(other_m - distance_m) > SAME_PLANE_M):
            apart = abs(sense * other_m - distance_m)
            raise ConfigError(f"{where}: {name} lies {apart:.3f} m off the plane of {relation.faces[0]}; use distance")
    if relation.kind == "height" and abs(first[2]) <= HORIZONTAL_COSINE:
        raise ConfigError(f"{where}: {relation.faces[0]} is not horizontal; use distance")


def _groups(names: Sequence[str], relations: Sequence[Relation]) -> list[list[str]]:
    """Return the names of the faces of each family, in the order of ``names``."""
    group = {name: name for name in names}
    for relation in relations:
        if relation.kind != "parallel":
            joined = {group[name] for name in relation.faces}
            first: str = next(name for name in names if name in joined)
            group = {name: first if of in joined else of for name, of in group.items()}
    return [[name for name in names if group[name] == first] for first in dict.fromkeys(group.values())]


def _family(
    members: list[str],
    relations: Sequence[Relation],
    planes: Mapping[str, tuple[Array, float]],
    roles: Mapping[str, str],
    order: Sequence[str],
) -> Family:
    """Return the family of these faces. Its name is their role, else a relation's, else made from the first face's."""
    inside = [relation for relation in relations if relation.kind != "parallel" and relation.faces[0] in members]
    own_roles = sorted({roles[name] for name in members if name in roles})
    if len(own_roles) > 1:
        raise ConfigError(
            f"target.faces.{members[0]}: tied to faces of another role ({', '.join(own_roles)}); give one role"
        )
    given_names = [relation.name for relation in inside if relation.name]
    default = members[0] + "-etc" * (len(members) > 1)
    name = next(iter([*own_roles, *given_names]), default)
    normal, distance_m = planes[members[0]]
    if abs(normal[2]) > HORIZONTAL_COSINE:
        normal, distance_m = np.array([0.0, 0.0, 1.0]), 0.0
        one_plane = len(members) == 1 or all(relation.kind == "same_plane" for relation in inside)
        if one_plane:
            distance_m = float(planes[members[0]][1] * np.sign(planes[members[0]][0][2]))
    else:
        one_plane = all(relation.kind == "same_plane" for relation in inside)
    return Family(name, normal, distance_m, tuple(order.index(member) for member in members), one_plane)


def _refuse_double_names(names: Sequence[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            how = "its faces are not in one plane by the relations; tie them with same_plane" if name in ROLES else (
                "two families have this name; give one another"
            )
            raise ConfigError(f"target.relations: {name}: {how}")
