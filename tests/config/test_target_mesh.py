"""Faces of a target from a mesh: the same target as by its corners, and what is refused."""

import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline.config.load import load_pool
from pipeline.config.target import Faces
from pipeline.errors import ConfigError
from pipeline.simulation.scenario import load_scenario
from pipeline.target.design import target_of

CORNERS = {
    "wall": [[0, 3, -4], [0, -3, -4], [0, -3, 2], [0, 3, 2]],
    "return": [[0, -3, -4], [1.2, -4, -4], [1.2, -4, 2], [0, -3, 2]],
    "cope": [[0, -3, 2], [1, -3, 2], [1, 3, 2], [0, 3, 2]],
}
PLACE = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}
Polygons = dict[str, list[list[list[float]]]]


def pool(folder: Path, **target: Any) -> Path:
    path = folder / "pool.yaml"
    path.write_text(yaml.safe_dump({"target": {"kind": "faces", "origin": PLACE, **target}}), encoding="utf-8")
    return path


def cut(corners: list[list[float]]) -> list[list[list[float]]]:
    """Two triangles on either side of a strip: four pieces, with corners in the middle of straight edges."""
    a, b, c, d = (np.array(corner, dtype=float) for corner in corners)
    e, f = (a + b) / 2, (c + d) / 2
    return [[p.tolist() for p in piece] for piece in ([a, e, f, d], [e, b, f], [b, c, f])]


def obj(folder: Path, polygons: Polygons, word: str = "g", name: str = "target.obj") -> str:
    lines, number = [], 0
    for group, pieces in polygons.items():
        lines.append(f"{word} {group}")
        for piece in pieces:
            lines += [f"v {' '.join(map(str, corner))}" for corner in piece]
            lines.append("f " + " ".join(str(number + k + 1) for k in range(len(piece))))
            number += len(piece)
    (folder / name).write_text("mtllib ../../etc/passwd\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return name


def ply(folder: Path, pieces: list[tuple[int, list[list[float]]]], binary: bool, column: str = "group") -> str:
    vertices = [corner for _, piece in pieces for corner in piece]
    starts = np.cumsum([0, *(len(piece) for _, piece in pieces)]).tolist()
    head = f"ply\nformat {'binary_little_endian' if binary else 'ascii'} 1.0\nelement vertex {len(vertices)}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz") + f"element face {len(pieces)}\n"
    head += f"property list uchar int vertex_indices\nproperty int {column}\nend_header\n"
    body = head.encode()
    for corner in vertices:
        body += struct.pack("<3d", *corner) if binary else (" ".join(map(str, corner)) + "\n").encode()
    for start, (group, piece) in zip(starts, pieces, strict=False):
        row = [len(piece), *range(start, start + len(piece)), group]
        body += struct.pack(f"<B{len(piece) + 1}i", *row) if binary else (" ".join(map(str, row)) + "\n").encode()
    (folder / "target.ply").write_bytes(body)
    return "target.ply"


def same_outline(one: Any, other: Any) -> bool:
    """The same corners in the same sense, from whichever the line begins."""
    first, second = np.array(one, dtype=float), np.array(other, dtype=float)
    return first.shape == second.shape and any(np.allclose(np.roll(first, k, 0), second) for k in range(len(first)))


def faces_in(path: Path) -> dict[str, Any]:
    target = load_pool(path).target
    assert isinstance(target, Faces)
    return {name: face.corners for name, face in target.faces.items()}


@pytest.mark.parametrize("word", ["g", "o"])
def test_groups_of_an_obj_are_faces_whatever_they_are_cut_into(tmp_path: Path, word: str) -> None:
    mesh = obj(tmp_path, {name: cut(corners) for name, corners in CORNERS.items()}, word)
    path = pool(tmp_path, mesh=mesh, faces={"cope": {"seen": "dry"}})
    found = faces_in(path)
    assert set(found) == set(CORNERS)
    assert all(same_outline(found[name], CORNERS[name]) for name in CORNERS)
    target = load_pool(path).target
    assert isinstance(target, Faces)
    assert {name: face.seen for name, face in target.faces.items()} == {"wall": "both", "return": "both", "cope": "dry"}
    normals = {face.name: face.normal for face in target_of(target).faces}
    np.testing.assert_allclose(normals["wall"], [-1, 0, 0], atol=1e-12)  # out of the wall, towards the boat
    np.testing.assert_allclose(normals["cope"], [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize("binary", [False, True])
def test_a_plys_property_group_makes_faces(tmp_path: Path, binary: bool) -> None:
    pieces = [(k, triangle) for k, name in enumerate(CORNERS) for triangle in triangles(CORNERS[name])]
    path = pool(tmp_path, mesh=ply(tmp_path, pieces, binary), faces={"group-2": {"seen": "dry"}})
    found = faces_in(path)
    assert set(found) == {"group-0", "group-1", "group-2"}
    assert all(same_outline(found[f"group-{k}"], CORNERS[name]) for k, name in enumerate(CORNERS))


def triangles(corners: list[list[float]]) -> list[list[list[float]]]:
    return [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]


def test_triangles_and_others_in_one_text_ply(tmp_path: Path) -> None:
    pieces = [(7, piece) for piece in cut(CORNERS["wall"])]
    assert same_outline(faces_in(pool(tmp_path, mesh=ply(tmp_path, pieces, False)))["group-7"], CORNERS["wall"])
    with pytest.raises(ConfigError, match=r"triangles and other polygons, in binary|holds no faces that can be read"):
        load_pool(pool(tmp_path, mesh=ply(tmp_path, pieces, True)))


def test_a_face_of_its_own_beside_the_mesh_and_in_a_scenario(tmp_path: Path) -> None:
    mesh = obj(tmp_path, {"wall": [CORNERS["wall"]]})
    path = pool(tmp_path, mesh=mesh, faces={"cope": {"corners": CORNERS["cope"]}}, azimuth_deg=20.0)
    assert list(faces_in(path)) == ["wall", "cope"]
    scenario = load_scenario(path).target
    assert isinstance(scenario, Faces)
    assert list(scenario.faces) == ["wall", "cope"]


WALL = CORNERS["wall"]
HOLE = [
    [[0, 3, -4], [0, -3, -4], [0, -1, 0], [0, 1, 0]], [[0, -3, -4], [0, -3, 2], [0, -1, 1], [0, -1, 0]],
    [[0, -3, 2], [0, 3, 2], [0, 1, 1], [0, -1, 1]], [[0, 3, 2], [0, 3, -4], [0, 1, 0], [0, 1, 1]],
]
APART = [[[0, y + 1, 0], [0, y, 0], [0, y, 1], [0, y + 1, 1]] for y in (0, 2)]
REFUSED: Iterable[tuple[str, Polygons, dict[str, Any], str]] = (
    ("hole", {"wall": HOLE}, {}, "hole, or is in several pieces"),
    ("pieces", {"wall": APART}, {}, "hole, or is in several pieces"),
    ("name", {"Wall 1": [WALL]}, {}, "must be a name"),
    ("unknown", {"wall": [WALL]}, {"faces": {"wal": {"seen": "dry"}}}, "and is no group of the mesh: wall"),
    ("twice", {"wall": [WALL]}, {"faces": {"wall": {"corners": WALL}}}, "has corners here and in the mesh"),
    ("away", {"wall": [WALL]}, {"mesh": "../target.obj"}, "must name a file beside this one"),
    ("absent", {"wall": [WALL]}, {"mesh": "targets.obj"}, "cannot be read"),
    ("kind", {"wall": [WALL]}, {"mesh": "target.stl"}, "neither .obj nor .ply"),
    ("list", {"wall": [WALL]}, {"mesh": ["target.obj"]}, "must name a file"),
    ("nul", {"wall": [WALL]}, {"mesh": "a\0.obj"}, "must name a file"),
    ("empty", {"wall": []}, {}, "faces"),
    ("many", {f"w{k}": [WALL] for k in range(501)}, {}, "has 501 groups of faces, of 1 to 500"),
    ("faces", {"wall": [WALL]}, {"faces": ["wall"]}, "must be a mapping"),
)


@pytest.mark.parametrize(("polygons", "more", "words"), [pytest.param(*one[1:], id=one[0]) for one in REFUSED])
def test_refused(tmp_path: Path, polygons: Polygons, more: dict[str, Any], words: str) -> None:
    mesh = obj(tmp_path, polygons)
    (tmp_path / "target.stl").touch()
    with pytest.raises(ConfigError) as refusal:
        load_pool(pool(tmp_path, **({"mesh": mesh} | more)))
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_vertices_written_anew_for_every_polygon_are_one(tmp_path: Path) -> None:
    """To a tenth of a millimetre, wherever they lie."""
    near = [[[x + 4e-5 * (k % 2), y, z] for x, y, z in piece] for k, piece in enumerate(cut(CORNERS["wall"]))]
    (found,) = faces_in(pool(tmp_path, mesh=obj(tmp_path, {"wall": near}))).values()
    assert same_outline(np.round(found, 3), CORNERS["wall"])


def test_a_ply_whose_groups_are_no_numbers(tmp_path: Path) -> None:
    ply(tmp_path, [(1, WALL)], False)
    text = (tmp_path / "target.ply").read_text()
    for old, new in (("0 1 2 3 1", "0 1 2 3 nan"), ("int group", "list uchar int group")):
        (tmp_path / "target.ply").write_text(text.replace(old, new))
        with pytest.raises(ConfigError, match=r"holds no faces that can be read|a whole number"):
            load_pool(pool(tmp_path, mesh="target.ply"))


def test_a_face_not_flat_and_one_not_convex_are_the_targets_to_refuse(tmp_path: Path) -> None:
    bent = [[0, 3, -4], [0.3, -3, -4], [0, -3, 2], [0, 3, 2]]
    notched = [[0, 3, -4], [0, -3, -4], [0, -3, 2], [0, 0, -3]]
    for corners, words in ((bent, "off their own plane"), (notched, "no convex polygon")):
        target = load_pool(pool(tmp_path, mesh=obj(tmp_path, {"wall": triangles(corners)}))).target
        with pytest.raises(ConfigError, match=words):
            target_of(target)


@pytest.mark.parametrize("kind", ["obj", "ply"])
def test_damaged_files_are_refused_in_one_line(tmp_path: Path, kind: str) -> None:
    if kind == "obj":
        obj(tmp_path, {name: cut(corners) for name, corners in CORNERS.items()})
    else:
        ply(tmp_path, [(k, WALL[:3]) for k in range(5)], True)
    whole = (tmp_path / f"target.{kind}").read_bytes()
    rng = np.random.default_rng(5)
    refused = []
    for trial in range(60):
        data = bytearray(whole)
        if trial % 2:
            data = data[: rng.integers(len(data))]
        for place in rng.integers(len(data) or 1, size=3).tolist() if data else []:
            data[place] = rng.integers(256)
        (tmp_path / f"target.{kind}").write_bytes(data)
        try:
            load_pool(pool(tmp_path, mesh=f"target.{kind}"))
        except ConfigError as error:
            refused.append(str(error))
    assert len(refused) > 20
    assert not [words for words in refused if "\n" in words]


def test_no_group_in_a_ply(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="have no property 'group', only vertex_indices, label"):
        load_pool(pool(tmp_path, mesh=ply(tmp_path, [(1, WALL)], False, "label")))
