"""``poolcal coarse``: what is wrong with marks and drawings, what is refused, and in which words."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from tests.support.marks import PLAIN, marks_of, run
from tests.support.surveys import BY_AXES, ON_LASER, ON_MBES, SHARED, World

Change = Callable[[dict[str, Any]], object]


def _drawing(frame: str, matrix: Any) -> Change:
    def change(marks: dict[str, Any]) -> None:
        drawn = marks[frame]["marks"]
        for name, at in drawn.items():
            drawn[name] = (np.array(matrix) @ at).tolist()

    return change


def _swapped(frame: str, one: str, other: str) -> Change:
    def change(marks: dict[str, Any]) -> None:
        drawn = marks[frame]["marks"]
        drawn[one], drawn[other] = drawn[other], drawn[one]

    return change


def _kept(frame: str, *names: str) -> Change:
    def change(marks: dict[str, Any]) -> None:
        marks[frame]["marks"] = {name: at for name, at in marks[frame]["marks"].items() if name in names}

    return change


def _then(*changes: Change) -> Change:
    return lambda marks: [change(marks) for change in changes]


def _survey(factor: float) -> Change:
    def change(marks: dict[str, Any]) -> None:
        marks["survey"]["marks"] = {k: [factor * x for x in at] for k, at in marks["survey"]["marks"].items()}

    return change


def _in_line(marks: dict[str, Any]) -> None:
    for place, name in enumerate(ON_LASER):
        marks["laser"]["marks"][name] = [0.1 * place, 0.001 * (place == 1), 0.0]


def _set(frame: str, **values: Any) -> Change:
    return lambda marks: marks[frame].update(values)


FLIP_X, FLIP_Z = np.diag([-1.0, 1, 1]), np.diag([1.0, 1, -1])
REFUSED: dict[str, tuple[Change, tuple[str, ...]]] = {
    "mirror": (_drawing("laser", FLIP_X), ("laser.marks", "mirror-imaged", "sign of x changed")),
    "mirror of the body": (_drawing("body", FLIP_Z), ("body.marks", "mirror-imaged", "sign of z changed")),
    "mirror, three marks": (
        _then(_kept("mbes", "M1", "M2", "M3"), _drawing("mbes", FLIP_X)),
        ("mbes.marks", "mirror-imaged", "sign of x changed", "from session.yaml's"),
    ),
    "line": (_in_line, ("laser.marks", "all 4 lie nearly in a line", "add a mark")),
    "exact line": (
        lambda marks: marks["mbes"].update(marks={m: [0.1 * k, 0.2 * k, 0] for k, m in enumerate(ON_MBES)}),
        ("mbes.marks", "nearly in a line", "not determined"),
    ),
    "two marks": (_kept("mbes", "M1", "M2"), ("mbes.marks", "2 usable marks", "survey more")),
    "mm in a drawing": (_drawing("mbes", 1000 * np.eye(3)), ("mbes", "its drawing's coordinates seem to be in mm")),
    "feet in a drawing": (_drawing("laser", np.eye(3) / 0.3048), ("laser", "in feet", "give all in m")),
    "inches in a drawing": (_drawing("laser", np.eye(3) / 0.0254), ("laser", "in inches")),
    "cm in the survey": (_survey(100.0), ("the survey's coordinates seem to be in cm",)),
    "twice the size": (_drawing("mbes", 2 * np.eye(3)), ("mbes", "2 times as large", "check units")),
    "swapped": (_swapped("laser", "L2", "L4"), ("laser.marks", "L2 and L4 may be interchanged")),
    "swapped, of six": (_swapped("body", "I1", "B2"), ("body.marks", "I1 and B2 may be interchanged")),
    "swapped, of three": (
        _then(_kept("mbes", "M1", "M2", "M3"), _swapped("mbes", "M1", "M3")),
        ("mbes.marks", "M1 and M3 may be interchanged"),
    ),
    "unknown mark": (
        lambda marks: marks["laser"]["marks"].update(L9=[0, 0, 0]),
        ("laser.marks: L9 is not in survey.marks",),
    ),
    "unknown in leave_out": (lambda marks: marks.update(leave_out=["X"]), ("leave_out: X is not in survey.marks",)),
    "all left out": (
        lambda marks: marks.update(leave_out=list(marks["survey"]["marks"])),
        ("body.marks: 0 usable marks",),
    ),
    "left out too many": (lambda marks: marks.update(leave_out=["L1", "L3"]), ("laser.marks: 2 usable",)),
    "both ways": (_set("body", axes={"origin": "I1", "forward": ["I3", "I1"], "roll_deg": 0.0}), ("marks, or axes",)),
    "roll missing": (
        lambda marks: marks.update(body={"axes": {"origin": "I1", "forward": ["I3", "I1"]}}),
        ("body.axes", "must have forward with roll_deg"),
    ),
    "axis of one mark": (
        lambda marks: marks.update(body={"axes": {"origin": "I1", "forward": ["I1", "I1"], "roll_deg": 0.0}}),
        ("two marks for the axis, not I1 twice",),
    ),
    "steep axis": (
        lambda marks: marks.update(body={"axes": {"origin": "I1", "forward": ["M1", "L1"], "roll_deg": 0.0}}),
        ("body.axes: the line from M1 and L1 rises by", "z is up"),
    ),
    "axis left out": (
        lambda marks: marks.update(
            body={"axes": {"origin": "I1", "forward": ["I3", "B1"], "roll_deg": 0.0}}, leave_out=["B1"]
        ),
        ("body.axes.forward: B1 is in leave_out",),
    ),
    "no sensor": (lambda marks: [marks.pop("laser"), marks.pop("mbes")], ("must have laser or mbes",)),
    "two coordinates": (_set("laser", marks={"L1": [0, 0]}), ("laser.marks.L1.at.2: is missing",)),
    "sigma of nothing": (_set("survey", sigma_m=0.0), ("survey.sigma_m.0 = 0.0", "greater than or equal to 0.00001")),
    "text": (_set("survey", marks={"L1": "here"}), ("survey.marks.L1", "'here'")),
    "not a mapping": (lambda marks: marks.update(laser=[1]), ("laser = [1]",)),
    "control characters": (
        lambda marks: marks["survey"]["marks"].update({"a\x1b[2J": [0, 0, 0]}),
        ("must have no control characters",),
    ),
    "far away": (
        lambda marks: marks.update(marks_of(World(mounts={"laser": (0, 0, 0, 0, 300.0, 0), "mbes": (0,) * 6}))),
        ("laser: lies 300 m from the INS", "give all coordinates in m"),
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_refused_and_in_which_words(what: str, session: Path) -> None:
    change, words = REFUSED[what]
    marks = marks_of(World())
    change(marks)
    told = run(session, marks)
    assert told.status == 2, told.out + told.err
    (line,) = told.err.splitlines()
    assert line.startswith("poolcal: ")
    assert "marks.yaml" in line
    for word in words:
        assert word in line, line
    assert told.out == ""
    assert sorted(path.name for path in session.iterdir()) == ["session.yaml"]
    assert (session / "session.yaml").read_text(encoding="utf-8") == PLAIN


def test_a_wrong_mark_is_named_and_nothing_is_written(session: Path, tmp_path: Path) -> None:
    marks, out = marks_of(World()), tmp_path / "found.yaml"
    marks["survey"]["marks"]["M3"][1] += 0.05
    told = run(session, marks, "--yaml", out)
    assert told.status == 1
    assert re.search(r"mbes  M3 .* suspicious", told.out)
    assert "Wrong: mark M3 (mbes) does not fit." in told.out
    assert "Nothing is written: measure again, or use leave_out." in told.out
    assert (session / "session.yaml").read_text(encoding="utf-8") == PLAIN
    found = yaml.safe_load(out.read_text(encoding="utf-8"))
    assert found["agrees"] is False
    np.testing.assert_allclose(list(found["mounts"]["mbes"]["mount"].values()), World().mounts["mbes"], atol=2.0)
    told = run(session, marks | {"leave_out": ["M3"]})
    assert told.status == 0
    assert "But look: mbes.marks lie in one plane: a mirror-imaged drawing would not show." in told.out


def test_with_three_marks_a_misfit_names_candidates(session: Path) -> None:
    marks = marks_of(World())
    _kept("laser", "L1", "L2", "L3")(marks)
    marks["survey"]["marks"]["L1"][0] += 0.05
    told = run(session, marks)
    assert told.status == 1
    assert "the wrong one cannot be identified: three marks in a frame are too few for that" in told.out
    assert all(f"L{k} (laser)" in told.out for k in (1, 2, 3))
    assert "The mounts above are with all marks." in told.out


def test_a_drawing_of_something_else_pins_nothing_and_a_wrong_mark_elsewhere_is_still_named(session: Path) -> None:
    marks = marks_of(World())
    marks["mbes"]["marks"] = {m: [0.3 * k % 0.5, -0.2 * k % 0.3, 0.1 * k * k % 0.3] for k, m in enumerate(ON_MBES)}
    marks["survey"]["marks"]["I2"][0] += 0.05
    told = run(session, marks)
    assert told.status == 1, told.err
    assert "Wrong: mark I2 (body) does not fit.\nWrong: still the marks do not agree" in told.out
    assert "mark M" not in told.out
    assert all(f"M{k} (mbes)" in told.out for k in (1, 2, 3, 4))


def test_a_wrong_survey_of_a_shared_mark_is_told_from_a_wrong_drawing(session: Path) -> None:
    marks = marks_of(SHARED)
    marks["survey"]["marks"]["B1"][2] += 0.05
    assert "mark B1 (survey) does not fit" in run(session, marks).out
    marks = marks_of(SHARED)
    marks["body"]["marks"]["B1"][2] += 0.05
    assert "mark B1 (body) does not fit" in run(session, marks).out


def test_a_mirror_image_of_three_marks_that_only_tilts_is_warned_of(session: Path) -> None:
    marks = marks_of(World())
    _kept("mbes", "M1", "M2", "M3")(marks)
    _drawing("mbes", FLIP_Z)(marks)
    told = run(session, marks, "--no-write")
    assert told.status == 0
    assert re.search(r"mbes.marks lie in one plane: .* would not show \(with the sign of z changed", told.out)
    assert re.search(r"But look: mbes.mount is \d+° from session.yaml's", told.out)


def test_an_axis_the_wrong_way_round_is_warned_of(session: Path) -> None:
    body = {"axes": {"origin": "O", "forward": ["A2", "A1"], "roll_deg": -1.7}}
    told = run(session, marks_of(BY_AXES) | {"body": body}, "--no-write")
    assert told.status == 0
    assert re.search("But look: laser.mount is 1(79|80)° from session.yaml's", told.out)
