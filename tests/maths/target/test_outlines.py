"""Faces and relations into a target: planes worked out by hand, and what cannot be meant."""

import numpy as np
import pytest

from pipeline.errors import ConfigError
from pipeline.maths.target.outlines import Outline, Relation, build_target
from tests.support.targets import by_letters

WALL = Outline("wall", [(0, 2, -3), (0, -2, -3), (0, -2, 2), (0, 2, 2)])
LEDGE = Outline("ledge", [(-0.5, 1, -1), (-0.5, -1, -1), (0, -1, -1), (0, 1, -1)])
COPE = Outline("cope", [(0, -2, 2), (1, -2, 2), (1, 2, 2), (0, 2, 2)])
FOOT = Outline("foot", [(-0.3, 2, -4), (-0.3, -2, -4), (-0.3, -2, -3), (-0.3, 2, -3)])


def families(*relations: Relation, outlines: tuple[Outline, ...] = (WALL, LEDGE, COPE, FOOT)):
    return {one.name: one for one in build_target(outlines, relations, 0.0, None).families}


def test_without_relations_each_face_is_its_own_family() -> None:
    found = families()
    assert list(found) == ["wall", "foot", "ledge", "cope"]  # level ones last
    assert found["wall"].normal.tolist() == [-1, 0, 0]
    assert found["foot"].distance_m == pytest.approx(0.3)
    assert found["ledge"].normal.tolist() == [0, 0, 1]
    assert found["ledge"].distance_m == -1
    assert all(one.one_plane for one in found.values())


def test_a_known_distance_makes_one_family_with_offsets() -> None:
    model = build_target([WALL, LEDGE, COPE, FOOT], [Relation("distance", ("wall", "foot"))], 0.0, None)
    assert [one.name for one in model.families] == ["wall-etc", "ledge", "cope"]
    offsets = {face.name: face.offset_m for face in model.faces}
    assert offsets["wall"] == 0
    assert offsets["foot"] == pytest.approx(0.3)  # along the normal, towards the boat


def test_known_heights_are_offsets_from_zero_and_undersides_have_the_opposite_sense() -> None:
    under = Outline("under", [(-0.5, 1, -1.2), (0, 1, -1.2), (0, -1, -1.2), (-0.5, -1, -1.2)])
    outlines = [WALL, LEDGE, under, COPE]
    model = build_target(outlines, [Relation("height", ("ledge", "under", "cope"), "levels")], 0.0, None)
    found = {face.name: (face.sense, face.offset_m) for face in model.faces if face.family == "levels"}
    assert found == {"ledge": (1, -1), "under": (-1, pytest.approx(-1.2)), "cope": (1, 2)}


def test_parallel_at_an_unknown_distance_ties_two_families() -> None:
    model = build_target([WALL, FOOT], [Relation("parallel", ("wall", "foot"))], 0.0, None)
    assert model.parallel == (("wall", "foot"),)
    assert [face.offset_m for face in model.faces] == [0, 0]


def test_a_face_that_meets_another_leaves_a_crease_in_it() -> None:
    model = build_target([WALL, LEDGE, COPE, FOOT], [], 0.0, None)
    creases = {face.name: face.creases_m for face in model.faces}
    ((one, other),) = creases["wall"]  # the ledge's; the cope and the foot meet it at its edges
    assert sorted([one.round(2).tolist(), other.round(2).tolist()]) == [[0, -1, -1], [0, 1, -1]]
    assert creases["ledge"] == ()
    wall = model.faces[0]
    near = np.array([[0, 0.5, -1.02], [0, 0.5, -0.95], [0, 1.05, -1.0], [0, 0.5, -1.2]])
    clear = wall.clearance(near, margin_m=0.03)
    assert (clear > 0).tolist() == [False, True, True, True]
    assert clear[1] == pytest.approx(0.02)


def test_where_two_faces_make_an_outer_corner() -> None:
    """The cope lies on top of the wall; the step stands out of its foot, and the wall ends there in an inner corner."""
    wall = Outline("wall", [(0, 1, -3), (0, -1, -3), (0, -1, 2), (0, 1, 2)])
    cope = Outline("cope", [(0, 1, 2), (0, -1, 2), (1, -1, 2), (1, 1, 2)])
    step = Outline("step", [(-1, 1, -3), (-1, -1, -3), (0, -1, -3), (0, 1, -3)])
    short = Outline("short", [(0, 1, 2), (0, 0, 2), (1, 0, 2), (1, 1, 2)])  # half of the wall's edge is its own
    model = build_target([wall, cope, step], [], 0.0, None)
    assert [face.outer_edges for face in model.faces] == [
        (False, False, True, False), (True, False, False, False), (False, False, False, False),
    ]  # fmt: skip
    ends = build_target([wall, short], [], 0.0, None).faces
    assert (ends[0].outer_edges[2], ends[1].outer_edges[0]) == (False, True)
    turned = model.mirrored().faces[1]  # its corners run the other way round
    assert turned.outer_edges == (False, False, True, False)
    assert turned.vertices_m[[2, 3]].tolist() == [[0, 1, 2], [0, -1, 2]]


def test_the_patents_target_has_no_creases_and_the_families_of_old() -> None:
    model = by_letters(8.0, 3.0, 1.0, 0.5)
    assert [one.name for one in model.families] == ["P1", "P2", "P3", "H"]
    assert not any(face.creases_m for face in model.faces)
    assert not model.symmetric
    assert model.front().name == "P2"


@pytest.mark.parametrize(
    ("outlines", "relations", "words"),
    [
        ([Outline("a", [(0, 2, -3), (0, -2, -3), (0.1, -2, 2), (0, 2, 2)])], [], "mm off their own plane"),
        ([Outline("a", [(0, 2, 0), (0, -2, 0), (0, 2, 2), (0, -2, 2)])], [], "0.0000 m²"),
        ([Outline("a", [(0, 2, 0), (0, -2, 0), (0, -2, 3), (0, 0, 1), (0, 2, 3)])], [], "no convex polygon"),
        ([Outline("a", WALL.corners[::-1])], [], "looks away from the boat"),
        ([WALL], [Relation("same_plane", ("wall", "door"))], "'door' is no face"),
        ([WALL, LEDGE], [Relation("parallel", ("wall", "ledge"))], "turned by 90.00°"),
        ([WALL, FOOT], [Relation("same_plane", ("wall", "foot"))], "lies 0.300 m off the plane of wall"),
        ([WALL, FOOT], [Relation("height", ("wall", "foot"))], "wall is not horizontal"),
        ([Outline("a", WALL.corners, "P2"), Outline("b", FOOT.corners, "P2")], [], "not in one plane"),
        (
            [Outline("a", WALL.corners, "P2"), Outline("b", FOOT.corners, "P1")],
            [Relation("distance", ("a", "b"))],
            "another role (P1, P2)",
        ),
    ],
)
def test_what_cannot_be_meant_is_one_line(outlines, relations, words: str) -> None:
    with pytest.raises(ConfigError, match=r".") as refused:
        build_target(outlines, relations, 0.0, None)
    assert words in str(refused.value)


@pytest.mark.parametrize(("back_m", "refused"), [(3.01, False), (2.99, True)])
def test_a_face_across_the_boat_may_look_back_at_it(back_m: float, refused: bool) -> None:
    """The other wall of a lock looks toward +x; nearer than 3 m no boat passes between: its corners are clockwise."""
    across = Outline("across", [(x - back_m, y, z) for x, y, z in WALL.corners[::-1]])
    if refused:
        with pytest.raises(ConfigError, match="looks away from the boat"):
            build_target([WALL, across], [], 0.0, None)
    else:
        assert build_target([WALL, across], [], 0.0, None).faces[1].normal[0] == pytest.approx(1.0)
