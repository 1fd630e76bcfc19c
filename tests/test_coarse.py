"""``poolcal coarse``: what is refused and in which words, what is found, and how session.yaml is edited."""

import errno
import os
import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline.config import Laser, load_session
from pipeline.errors import ConfigError
from pipeline.parsing import parse
from pipeline.session_edit import edited, refuse_other
from tests.end_to_end.places import Told, poolcal
from tests.maths.surveys import ALONG, ON_BODY, ON_LASER, ON_MBES, World

EXAMPLE = Path(__file__).parents[1] / "configs" / "marks.yaml"
KEYS = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m")
Change = Callable[[dict[str, Any]], object]

PLAIN = """\
# 会话 of boat A
name: 水池 a
ins: {files: [ins/*.gps], format: novatel}
laser:
  files: [laser/*.las]
  format: las   # the scanner's
  mount:
    yaw_deg: 40.0      # counter-clockwise
    roll_deg: 0.3

    pitch_deg: -0.2
    x_m: 0.2
    y_m: 5.0e-1
    z_m: +1   # up
  # of the laser: the last
mbes:
  mount: {roll_deg: -48, pitch_deg: 2.0, yaw_deg: -2.8, x_m: 0.38, y_m: 0.12, z_m: -1.0}   # flow, 流
  files: [mbes/*.xtf]
  format: r2sonic
# end
"""


def marks_of(world: World, seed: int | None = 1) -> dict[str, Any]:
    """MARKS of a world, with errors of 1 mm where there is a seed."""
    rng = np.random.default_rng(seed)
    scale = 0.0 if seed is None else 0.0007
    survey = {name: (at + scale * rng.normal(size=3)).round(9).tolist() for name, at in world.survey().items()}
    drawings = {
        frame: {"marks": {name: (at + scale / 2 * rng.normal(size=3)).round(9).tolist() for name, at in marks.items()}}
        for frame, marks in world.drawings().items()
    }
    return {"survey": {"marks": survey}, **drawings}


@pytest.fixture
def session(tmp_path: Path) -> Path:
    folder = tmp_path / "session"
    folder.mkdir()
    (folder / "session.yaml").write_text(PLAIN, encoding="utf-8")
    return folder


def run(session: Path, marks: dict[str, Any] | Path, *words: object) -> Told:
    file = marks if isinstance(marks, Path) else session.parent / "marks.yaml"
    if isinstance(marks, dict):
        file.write_text(yaml.safe_dump(marks, sort_keys=False, allow_unicode=True), encoding="utf-8")
    return poolcal("coarse", file, "--session", session, *words)


def mounts_in(session: Path) -> dict[str, list[float]]:
    content = load_session(session)
    return {name: [getattr(getattr(content, name).mount, key) for key in KEYS] for name in ("laser", "mbes")}


# --- what is found ---------------------------------------------------------------------------------------------------
SHARED = World(shared=(("B1", "body", "laser"), ("B2", "body", "mbes")))
BY_AXES = World(frames={"body": {"O": (0.0, 0.0, 0.0)} | ALONG, "laser": ON_LASER, "mbes": ON_MBES})
FORWARD = {"axes": {"origin": "O", "forward": ["A1", "A2"], "roll_deg": 1.7}}
STARBOARD = {"axes": {"origin": "O", "starboard": ["S1", "S2"], "pitch_deg": -2.3}}


@pytest.mark.parametrize(
    ("world", "body"), [(SHARED, {}), (BY_AXES, FORWARD), (BY_AXES, STARBOARD)], ids=["marks", "forward", "starboard"]
)
def test_session_yaml_gets_the_true_mounts(world: World, body: dict[str, Any], session: Path) -> None:
    """From a survey without errors, to the last digit written; signs are those of an independent forward model."""
    told = run(session, marks_of(world, None) | ({"body": body} if body else {}))
    assert told.status == 0, told.err
    for name, found in mounts_in(session).items():
        np.testing.assert_allclose(found, world.mounts[name], atol=3e-6 if not body else 6e-4)
    content = load_session(session)
    assert content.laser.mount_origin is not None
    assert content.laser.mount_origin.method == "coarse"
    assert content.laser.mount_origin.file == "marks.yaml"
    assert np.array(content.mbes.mount_covariance).shape == (6, 6)


def test_the_example_solves(session: Path) -> None:
    told = run(session, EXAMPLE)
    assert told.status == 0, told.err
    found = mounts_in(session)
    np.testing.assert_allclose(found["laser"], (0.35, -0.22, 0.41, 0.21, 0.48, 1.10), atol=1.2)
    np.testing.assert_allclose(found["mbes"], (-48.8, 1.2, -2.0, 0.30, 0.20, -2.01), atol=1.2)
    text = EXAMPLE.read_text(encoding="utf-8")
    for key in ("survey", "marks", "body", "axes", "laser", "mbes", "leave_out", "roll_sigma_deg", "pitch_sigma_deg"):
        assert f"{key}:" in text


def test_the_example_solves_by_axes_too(session: Path) -> None:
    text = EXAMPLE.read_text(encoding="utf-8")
    body = re.search(r"^body:.*?(?=^laser:)", text, re.M | re.S)
    assert body is not None
    for line in re.findall(r"# (axes: \{.*?\})", body[0]):
        file = session.parent / "axes.yaml"
        file.write_text(text.replace(body[0], f"body:\n  {line}\n\n"), encoding="utf-8")
        told = run(session, file, "--no-write")
        assert told.status == 0, told.err


def test_screen_and_yaml_say_the_same(session: Path, tmp_path: Path) -> None:
    out = tmp_path / "found.yaml"
    told = run(session, marks_of(SHARED), "--yaml", out, "--no-write")
    assert told.status == 0, told.err
    assert (session / "session.yaml").read_text(encoding="utf-8") == PLAIN
    assert "not written (--no-write)" in told.out
    found = yaml.safe_load(out.read_text(encoding="utf-8"))
    assert found["agrees"] is True
    assert found["global_test"]["degrees_of_freedom"] == 3 * 16 - 18
    assert f"limit {found['global_test']['limit']:.1f}, 30 degrees of freedom: passed" in told.out
    for name in ("laser", "mbes"):
        block = found["mounts"][name]
        truth = dict(zip(KEYS, SHARED.mounts[name], strict=True))
        for key in KEYS:
            assert abs(block["mount"][key] - truth[key]) < 4 * block["sigma_mount"][key]
            assert f"{block['mount'][key]:.4f}" in told.out
            assert f"{block['sigma_mount'][key]:.4f}" in told.out
    assert found["mounts"]["mbes"]["change"]["y_m"] == pytest.approx(found["mounts"]["mbes"]["mount"]["y_m"] - 0.12)
    assert len(found["residuals"]) == 16
    assert "B1" in told.out
    assert run(session, marks_of(SHARED), "--yaml", out, "--no-write").status == 0  # its own file is replaced
    mine = session.parent / "marks.yaml"
    for there, words in ((mine, "did not write it"), (session / "a.yaml", "lies in the folder")):
        refused = run(session, marks_of(SHARED), "--yaml", there)
        assert refused.status == 2
        assert words in refused.err


def test_residuals_are_in_body_axes(session: Path, tmp_path: Path) -> None:
    """A mark of little weight, measured 20 mm too far forward on a boat that heads elsewhere, lies off in y."""
    marks, out = marks_of(World(), None), tmp_path / "found.yaml"
    level = np.array(marks["survey"]["marks"]["B1"])
    world = World()
    world.frames = {**world.frames, "body": {**ON_BODY, "B1": (0.35, 0.77, 0.20)}}
    moved = np.array(world.survey()["B1"])
    assert abs(moved - level).max() > 0.01
    marks["survey"]["marks"]["B1"] = {"at": moved.tolist(), "sigma_m": 0.2}
    assert run(session, marks, "--yaml", out, "--no-write").status == 0
    rows = {row["mark"]: row for row in yaml.safe_load(out.read_text(encoding="utf-8"))["residuals"]}
    np.testing.assert_allclose(rows["B1"]["residual_body_mm"], [0.0, 20.0, 0.0], atol=0.1)


# --- what is wrong ---------------------------------------------------------------------------------------------------
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
    "two marks": (_kept("mbes", "M1", "M2"), ("mbes.marks", "2 usable mark(s)", "survey more")),
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
        ("body.marks: 0 usable mark(s)",),
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
    assert "which is wrong cannot be pinned: of three in a frame none can" in told.out
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


# --- session.yaml as text --------------------------------------------------------------------------------------------
def _only_mounts_changed(before: str, after: str) -> None:
    """Every line but numbers of mounts and the new keys is as it was."""
    lines = iter(after.splitlines(keepends=True))
    for line in before.splitlines(keepends=True):
        pattern = re.sub(r"((?:roll|pitch|yaw)_deg: |[xyz]_m: )[-+.e0-9]+", r"\1NUMBER", line)
        wanted = re.escape(pattern).replace("NUMBER", r"-?[0-9]+\.[0-9]{6}")
        found = next(lines)
        while not re.fullmatch(wanted, found):
            ours = r"  (mount_origin: \{.*\}|mount_covariance: \[.*,|  \[.*\][,\]])\r?\n"
            assert re.fullmatch(ours, found), (found, wanted)
            found = next(lines)
    assert next(lines, None) is None


@pytest.mark.parametrize(
    "text",
    [PLAIN, PLAIN.replace("\n", "\r\n"), "\ufeff" + PLAIN, PLAIN.rstrip("\n"), PLAIN + "\n\n"],
    ids=["plain", "CRLF", "BOM", "no end of line", "blank lines"],
)
def test_nothing_but_mounts_is_changed(text: str, session: Path) -> None:
    path = session / "session.yaml"
    path.write_bytes(text.encode("utf-8"))
    assert run(session, marks_of(World(), None)).status == 0
    after = path.read_bytes().decode("utf-8")
    _only_mounts_changed(text, after)
    assert ("\r\n" in after) == ("\r\n" in text)
    assert after.count("\n") == text.count("\n") + 2 * 7
    for name, found in mounts_in(session).items():
        np.testing.assert_allclose(found, World().mounts[name], atol=3e-6)
    assert (session / "session.1.yaml").read_bytes() == text.encode("utf-8")


FLOW = (
    "{name: a, ins: {files: [i], format: table}, laser: {files: [l], format: las,\n"
    "  mount: {roll_deg: 0, pitch_deg: 0, yaw_deg: 0, x_m: 0, y_m: 0, z_m: 0}},  # 激光\n"
    " mbes: {files: [m], format: table}}\n"
)


def test_flow_style_and_a_missing_mount(session: Path) -> None:
    (session / "session.yaml").write_text(FLOW, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"mbes\.mount: is missing"):
        load_session(session)
    told = run(session, marks_of(World(), None))
    assert told.status == 0, told.err
    for name, found in mounts_in(session).items():
        np.testing.assert_allclose(found, World().mounts[name], atol=3e-6)
    assert "},  # 激光\n" in (session / "session.yaml").read_text(encoding="utf-8")


def test_a_missing_mount_of_what_was_not_surveyed_is_said(session: Path) -> None:
    (session / "session.yaml").write_text(FLOW, encoding="utf-8")
    marks = marks_of(World(), None)
    del marks["mbes"]
    told = run(session, marks)
    assert told.status == 0, told.err
    assert "But mbes still has no mount there." in told.out
    assert "mbes mount" not in told.out


def test_twice_is_once_and_another_survey_is_kept_apart(session: Path) -> None:
    marks = marks_of(World())
    assert run(session, marks).status == 0
    first = (session / "session.yaml").read_bytes()
    told = run(session, marks)
    assert told.status == 0
    assert "has these mounts already; not written" in told.out
    assert (session / "session.yaml").read_bytes() == first
    assert sorted(path.name for path in session.iterdir()) == ["session.1.yaml", "session.yaml"]
    (session / "session.3.yaml").write_text("mine")
    for number, seed in ((2, 5), (4, 6)):
        before = (session / "session.yaml").read_bytes()
        assert f"session.{number}.yaml" in run(session, marks_of(World(), seed)).out
        assert (session / f"session.{number}.yaml").read_bytes() == before
    assert (session / "session.3.yaml").read_text() == "mine"
    assert (session / "session.yaml").read_bytes().count(b"mount_origin") == 2


def test_what_it_wrote_is_replaced_in_any_style(session: Path) -> None:
    """As blocks, as other programs write it, and between them comments and a key of ours alone."""
    assert run(session, marks_of(World())).status == 0
    path = session / "session.yaml"
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    del content["mbes"]["mount_covariance"]
    path.write_text(yaml.safe_dump(content, sort_keys=False) + "# end\n", encoding="utf-8")
    assert run(session, marks_of(World(), None)).status == 0
    for name, found in mounts_in(session).items():
        np.testing.assert_allclose(found, World().mounts[name], atol=3e-6)
    text = path.read_text(encoding="utf-8")
    assert [text.count(f"mount_{key}:") for key in ("origin", "covariance")] == [2, 2]
    assert text.endswith("# end\n")


@pytest.mark.parametrize("step", ["open", "fsync", "replace"])
def test_a_full_disk_leaves_everything_as_it_was(step: str, session: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    marks, calls = marks_of(World()), []

    def fails(*_: object, **__: object) -> None:
        calls.append(1)
        raise full

    with monkeypatch.context() as patched:
        if step == "open":
            real = Path.open
            patched.setattr(Path, "open", lambda self, *a, **k: fails() if "xb" in a else real(self, *a, **k))
        else:
            patched.setattr(*{"fsync": (os, "fsync"), "replace": (Path, "replace")}[step], fails)
        told = run(session, marks)
    assert calls
    assert told.status == 2
    assert "No space left on device" in told.err
    assert "make room" in told.err
    assert len(told.err.splitlines()) == 1
    assert sorted(path.name for path in session.iterdir()) == ["session.yaml"]
    assert (session / "session.yaml").read_text(encoding="utf-8") == PLAIN


@pytest.mark.parametrize(
    "text",
    [
        PLAIN.replace("    roll_deg: 0.3\n", "    ? roll_deg\n    : 0.3\n"),
        PLAIN.replace("roll_deg: 0.3", '"roll_deg": !!float "0.3"'),
        PLAIN.replace("laser:\n", "laser: !!map\n"),
        PLAIN.replace("  format: las ", "  'format' : \"las\" "),
        "---\n" + PLAIN + "...\n",
        PLAIN.partition("  files: [mbes")[0].replace("mbes:\n", "mbes:\n  files: [m]\n  format: table\n").rstrip("\n"),
    ],
)
def test_odd_yaml_is_edited_rightly(text: str, session: Path) -> None:
    (session / "session.yaml").write_text(text, encoding="utf-8")
    told = run(session, marks_of(World(), None))
    assert told.status == 0, told.err
    np.testing.assert_allclose(mounts_in(session)["laser"], World().mounts["laser"], atol=3e-6)


@pytest.mark.parametrize("after", ["", "# end\n", "ins: {files: [i], format: table}\n"])
def test_a_mount_comes_after_a_format_however_that_is_written(after: str, session: Path) -> None:
    block = "mbes:\n  files: [m]\n  format: >-\n    r2sonic\n\n"
    text = PLAIN.replace("ins: {files: [ins/*.gps], format: novatel}\n", "").partition("mbes:")[0]
    text += block + after if "ins" in after else "ins: {files: [i], format: table}\n" + block + after
    (session / "session.yaml").write_text(text, encoding="utf-8")
    told = run(session, marks_of(World(), None))
    assert told.status == 0, told.err
    np.testing.assert_allclose(mounts_in(session)["mbes"], World().mounts["mbes"], atol=3e-6)


def test_what_cannot_be_edited_in_place_is_refused() -> None:
    """What comes of an edit must say what was meant."""
    content = yaml.safe_load(PLAIN)
    refuse_other(PLAIN, content, {"laser": {"format": "las"}}, Path("session.yaml"))
    with pytest.raises(ConfigError, match="cannot be edited where it stands"):
        refuse_other(PLAIN, content, {"laser": {"format": "table"}}, Path("session.yaml"))
    with pytest.raises(ConfigError, match="cannot be edited where it stands"):
        refuse_other(PLAIN + "  {", content, {"laser": {}}, Path("session.yaml"))
    with pytest.raises(ConfigError, match=r"mbes: has no format"):
        edited("mbes: {files: [m]}\n", {"mbes": {"mount": {}}}, Path("session.yaml"))


def test_hostile_text_never_ends_otherwise(session: Path) -> None:
    """Marks and session.yaml with bytes changed, cut or doubled: one line, or a result; and a whole session.yaml."""
    rng = random.Random(3)
    right = yaml.safe_dump(marks_of(World()), sort_keys=False).encode()
    file = session.parent / "m.yaml"
    for turn in range(60):
        broken = bytearray(right if turn % 2 else PLAIN.encode())
        for _ in range(rng.randint(1, 4)):
            place = rng.randrange(len(broken))
            kind = rng.randrange(4)
            if kind == 0:
                broken[place] = rng.choice(b"\0\xff:-[]{}&*!|>'\"%@#\n\t 0e")
            elif kind == 1:
                del broken[place : place + rng.randint(1, 30)]
            elif kind == 2:
                broken[place:place] = broken[place : place + rng.randint(1, 30)]
            else:
                broken[place:place] = rng.choice([b"\n", b": ", b"- ", b"[[", b"1e999", b"*a", b"? ", b"!!python/x "])
        file.write_bytes(broken if turn % 2 else right)
        (session / "session.yaml").write_bytes(PLAIN.encode() if turn % 2 else broken)
        before = (session / "session.yaml").read_bytes()
        told = run(session, file)
        assert told.status in (0, 1, 2), told.err
        assert len(told.err.splitlines()) == (told.status == 2), told.err
        if told.status:
            assert (session / "session.yaml").read_bytes() == before
        else:
            assert load_session(session).laser.mount_origin is not None


# --- the covariance in session.yaml ----------------------------------------------------------------------------------
LASER: dict[str, Any] = {"files": ["a"], "format": "las", "mount": dict.fromkeys(KEYS, 0.0)}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ((0, 1, 0.5), "must be symmetric"),
        ((0, 0, -1.0), "must be"),
        (None, "has too few entries"),
        ("indefinite", "must be positive semidefinite"),
    ],
)
def test_a_covariance_that_is_none_is_refused(change: Any, words: str) -> None:
    matrix = np.eye(6)
    if isinstance(change, tuple):
        matrix[change[:2]] = change[2]
    elif change == "indefinite":
        matrix[:3, :3] = [[1, 0.9, -0.9], [0.9, 1, 0.9], [-0.9, 0.9, 1]]
    rows = matrix.tolist()[: 5 if change is None else 6]
    with pytest.raises(ConfigError) as refused:
        parse(Laser, LASER | {"mount_covariance": rows}, "session.yaml")
    (line,) = str(refused.value).splitlines()
    assert line.startswith("session.yaml: mount_covariance")
    assert words in line


def test_a_covariance_of_another_mount_is_refused() -> None:
    """As where the mount is entered by hand, and what poolcal wrote beside it stays."""
    six = {key: float(value) for key, value in LASER["mount"].items()}
    origin = {"method": "fine", "file": "a", "sha256": "0" * 64, "date": "2026-05-12", "software": "p", "mount": six}
    written = LASER | {"mount_covariance": (np.eye(6) * 1e-6).tolist(), "mount_origin": origin}
    assert parse(Laser, written, "s").mount_origin is not None
    by_hand = {"mount": six | {"z_m": six["z_m"] + 0.000001}}
    with pytest.raises(ConfigError, match="mount is not the one in mount_origin, to which mount_covariance belongs"):
        parse(Laser, written | by_hand, "s")
    assert parse(Laser, {key: one for key, one in (written | by_hand).items() if "_" not in key}, "s")


def test_a_covariance_without_rank_is_one() -> None:
    for matrix in (np.zeros((6, 6)), np.ones((6, 6)) * 1e-6, np.diag([1e-6, 0, 0, 1e-6, 0, 0])):
        assert parse(Laser, LASER | {"mount_covariance": matrix.tolist()}, "s").mount_covariance is not None
