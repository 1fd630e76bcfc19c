"""A target's faces from a mesh with face groups: OBJ (``g`` or ``o``) or PLY (an integer property ``group`` of faces).

trimesh reads the files. The polygons of a group form one face, whose border is their common outline. The corners of the
outline are put into the settings. Therefore all other code knows polygons only, and a run's settings hold the corners
that were used.
"""

import io
import operator
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.config.beside import content_beside
from pipeline.errors import ConfigError

Array = NDArray[np.float64]
Polygon = Sequence[int]
MOST_BYTES, MOST_GROUPS = 20_000_000, 500
SAME_M = 1e-4  # vertices nearer to each other are one: exporters write a vertex once for every face
STRAIGHT = 1e-4  # sine of the bend up to which a vertex is no corner
GROUP = "group"


def with_mesh(content: dict[str, Any], path: Path) -> dict[str, Any]:
    """Return the content of a pool's (or scenario's) file with the corners of its ``target.mesh`` written out.

    The mesh is a file beside ``path``, or in a folder beside it. Keys of a group in ``target.faces`` (seen, role) stay.
    Faces in ``target.faces`` with corners of their own are added. Raise ConfigError if the mesh cannot be used.
    """
    target = content.get("target")
    if not isinstance(target, dict) or target.get("kind") != "faces" or "mesh" not in target:
        return content
    mesh, given = target["mesh"], target.get("faces") or {}
    where = f"{path}: target.mesh = {mesh!r}"
    if not isinstance(mesh, str):
        raise ConfigError(f"{where}: must name a file beside this one, or in a folder beside it")
    if not isinstance(given, dict) or not all(isinstance(value, dict) for value in given.values()):
        raise ConfigError(f"{path}: target.faces: must be a mapping of each face's name to its settings; correct it")
    found = dict(_outlines(path, mesh, where))
    unknown = [key for key, value in given.items() if "corners" not in value and key not in found]
    if unknown:
        groups = ", ".join(list(found)[:20])
        raise ConfigError(f"{path}: target.faces.{unknown[0]}: has no corners, and is no group of the mesh: {groups}")
    twice = [key for key in found if "corners" in given.get(key, {})]
    if twice:
        raise ConfigError(f"{path}: target.faces.{twice[0]}: has corners here and in the mesh; take one of them out")
    faces = {key: {"corners": corners.tolist()} | given.get(key, {}) for key, corners in found.items()}
    faces |= {key: face for key, face in given.items() if key not in faces}
    return content | {"target": {key: value for key, value in target.items() if key != "mesh"} | {"faces": faces}}


Groups = Mapping[str, tuple[Array, Sequence[Polygon]]]


def _outlines(path: Path, mesh: str, where: str) -> Iterator[tuple[str, Array]]:
    """Yield the name of each group, and the corners (k, 3) of its outline in the polygons' sense of rotation."""
    content = content_beside(path, mesh, "target.mesh", MOST_BYTES)
    read = {".obj": _obj, ".ply": _ply}.get(Path(mesh).suffix.lower())
    if read is None:
        raise ConfigError(f"{where}: is neither .obj nor .ply; export it as one of them")
    try:
        groups = read(content, path.parent / mesh)
    except ConfigError:
        raise
    except Exception as error:  # the library may raise any exception for a damaged file
        reason = " ".join(str(error).split())[:100] or type(error).__name__
        raise ConfigError(f"{where}: holds no faces that can be read ({reason}); export it again") from error
    if not 0 < len(groups) <= MOST_GROUPS:
        raise ConfigError(f"{where}: has {len(groups)} groups of faces, of 1 to {MOST_GROUPS}; export the target alone")
    for name, (vertices, polygons) in groups.items():
        used = np.unique([number for polygon in polygons for number in polygon])
        if not len(used) or used[0] < 0 or used[-1] >= len(vertices) or not np.all(np.isfinite(vertices[used])):
            raise ConfigError(f"{where}: group {name!r}: a polygon's vertex is not there; export it again")
        own = [np.searchsorted(used, polygon).tolist() for polygon in polygons]
        yield name, _outline(vertices[used], own, f"{where}: group {name!r}")


def _obj(content: bytes, path: Path) -> Groups:
    from trimesh.exchange.obj import load_obj

    text = io.StringIO(content.decode("utf-8", errors="replace"), newline=None)
    scene = load_obj(text, skip_materials=True, split_groups=True, split_objects=True)
    meshes = scene.get("geometry", {"mesh": scene})
    return {name: (_array(mesh["vertices"]), np.asarray(mesh["faces"]).tolist()) for name, mesh in meshes.items()}


def _ply(content: bytes, path: Path) -> Groups:
    from trimesh.exchange.ply import load_ply

    mesh = load_ply(io.BytesIO(content))
    elements = mesh["metadata"]["_ply_raw"]["face"]
    columns, names = elements["data"], list(elements["properties"])
    if GROUP not in names:
        known = ", ".join(names)
        raise ConfigError(f"{path}: its faces have no property {GROUP!r}, only {known}; export it as OBJ with groups")
    polygons = columns[next(name for name in names if name.startswith("vertex_ind"))]
    if getattr(polygons, "dtype", np.dtype(object)).names:  # binary: a count before each list
        if np.any(polygons["f0"] != polygons["f0"][0]):
            raise ConfigError(f"{path}: triangles and other polygons, in binary; export it as text, or as triangles")
        polygons = polygons["f1"]
    found: dict[str, list[list[int]]] = {}
    for number, polygon in zip(np.ravel(_array(columns[GROUP])).tolist(), polygons, strict=True):
        if not abs(number) < MOST_BYTES:
            raise ConfigError(f"{path}: its faces' property {GROUP!r} is {number:g}; give each group a whole number")
        found.setdefault(f"group-{int(number)}", []).append([operator.index(k) for k in np.asarray(polygon).tolist()])
    vertices = _array(mesh["vertices"])
    return {name: (vertices, found[name]) for name in sorted(found, key=lambda name: (len(name), name))}


def _array(values: Any) -> Array:
    return np.asarray(values, dtype=np.float64)


def _outline(vertices: Array, polygons: Sequence[Polygon], where: str) -> Array:
    """Return the corners (k, 3) of the polygons' single outline: the edges that belong to one polygon only."""
    from scipy.sparse import coo_array  # the imports take a quarter of a second, and few targets are meshes
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(vertices).query_pairs(SAME_M, output_type="ndarray")
    count = len(vertices)
    _, place = connected_components(coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (count, count)))
    one_of = np.unique(place, return_index=True)[1]
    edges = {(int(place[a]), int(place[b])) for one in polygons for a, b in zip(one, [*one[1:], one[0]], strict=True)}
    around = {a: b for a, b in edges if a != b and (b, a) not in edges}
    if len(around) != sum(a != b and (b, a) not in edges for a, b in edges) or not around:
        raise ConfigError(f"{where}: its polygons make no single outline; give each face a group of its own")
    line = [min(around)]
    while around.get(line[-1], line[0]) != line[0] and len(line) <= len(around):
        line.append(around[line[-1]])
    if len(line) != len(around):
        raise ConfigError(f"{where}: has a hole, or is in several pieces; give each piece a group of its own")
    corners = vertices[one_of[line]]
    before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
    bend = np.linalg.norm(np.cross(before, after), axis=1)
    turns = bend > STRAIGHT * np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    return np.asarray(corners[turns])
