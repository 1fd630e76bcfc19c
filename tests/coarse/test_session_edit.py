"""What ``poolcal coarse`` changes in session.yaml, and how little: styles, comments, odd and hostile text."""

import random
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from pipeline.coarse.session_edit import check_edit, edit_mounts
from pipeline.config.load import load_session
from pipeline.errors import ConfigError
from tests.support.marks import PLAIN, marks_of, mounts_in, run
from tests.support.surveys import World

NEW = r"  (mount_origin: \{.*\}|mount_covariance:|  - \[.*\])\r?\n?"


def _only_mounts_changed(before: str, after: str) -> None:
    """Every line but numbers of mounts and the new keys is as it was; a comment behind a number may have moved."""
    lines = iter(after.splitlines(keepends=True))
    for line in before.splitlines(keepends=True):
        pattern = re.sub(r"((?:roll|pitch|yaw)_deg: |[xyz]_m: )[-+.e0-9]+", r"\1NUMBER", line)
        wanted = re.escape(pattern).replace("NUMBER", r"-?[0-9]+\.[0-9]{6}")
        wanted = re.sub(r"(\\ )+\\#", " +#", wanted) if "NUMBER" in pattern else wanted
        found = next(lines)
        while not re.fullmatch(wanted, found):
            assert re.fullmatch(NEW, found), (found, wanted)
            found = next(lines)
    assert all(re.fullmatch(NEW, line) for line in lines)


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
    assert after.count("\n") == text.count("\n") + 2 * 8
    for name, found in mounts_in(session).items():
        np.testing.assert_allclose(found, World().mounts[name], atol=3e-6)
    assert (session / "session.1.yaml").read_bytes() == text.encode("utf-8")


FLOW = (
    "{name: a, ins: {files: [i], format: table}, laser: {files: [l], format: las,\n"
    "  mount: {roll_deg: 0, pitch_deg: 0, yaw_deg: 0, x_m: 0, y_m: 0, z_m: 0}},\n"
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


def test_a_missing_mount_of_what_was_not_surveyed_is_said(session: Path) -> None:
    (session / "session.yaml").write_text(FLOW, encoding="utf-8")
    marks = marks_of(World(), None)
    del marks["mbes"]
    told = run(session, marks)
    assert told.status == 0, told.err
    assert "But mbes still has no mount there." in told.out
    assert "mbes mount" not in told.out


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
    path = Path("session.yaml")
    check_edit(PLAIN, PLAIN, {"laser": {"format": "las"}}, path)
    with pytest.raises(ConfigError, match="cannot be edited where it stands; write"):
        check_edit(PLAIN, PLAIN, {"laser": {"format": "table"}}, path)
    with pytest.raises(ConfigError, match="cannot be edited where it stands; write"):
        check_edit(PLAIN, PLAIN + "  {", {"laser": {}}, path)
    with pytest.raises(ConfigError, match="'# end' would be lost"):
        check_edit(PLAIN, PLAIN.replace("# end\n", ""), {"laser": {}}, path)
    with pytest.raises(ConfigError, match=r"mbes: has no format"):
        edit_mounts("mbes: {files: [m]}\n", {"mbes": {"mount": {}}}, path)


@pytest.mark.parametrize(
    ("text", "comment"),
    [
        (FLOW.replace("}},\n", "}},  # 激光\n"), "# 激光"),
        (PLAIN.replace("yaw_deg: -2.8, ", "yaw_deg: -2.8,  # inside\n    "), "# inside"),
    ],
    ids=["changed block", "changed mount"],
)
def test_a_comment_is_never_lost(text: str, comment: str, session: Path) -> None:
    """Inside brackets that change the library loses it: nothing is written, and the comment is named."""
    (session / "session.yaml").write_text(text, encoding="utf-8")
    told = run(session, marks_of(World(), None))
    assert told.status == 2
    assert f"the comment {comment!r} would be lost; put it on a line of its own" in told.err
    assert len(told.err.splitlines()) == 1
    assert [path.name for path in session.iterdir()] == ["session.yaml"]
    assert (session / "session.yaml").read_text(encoding="utf-8") == text


STYLES = """\
# 会话
---
name:  水池 a   # two blanks
ins: {files:   [i, # one
     j],   format: table}   # 惯导

# the laser

laser:
    format : las
    files:
        - 'a'   # a
        - "b"
    mount:
        roll_deg: 1  # r
        pitch_deg: 1
        yaw_deg: 1
        x_m: 1
        y_m: 1
        # z follows
        z_m: 1

# The sonar: a head

mbes:  # M
    svp: [[0, 1480],  # top
          [5, 1481]]  # bottom

    # which
    format: >-   # why
        r2sonic

    # two
    files: [m,n]
...
# after
"""


def test_style_and_comments_stay(session: Path) -> None:
    """But for blanks round a key's colon and in front of comments every line that is not a mount's stays, in its order;
    new keys stand in front of the next block's comment."""
    (session / "session.yaml").write_text(STYLES, encoding="utf-8")
    told = run(session, marks_of(World(), None))
    assert told.status == 0, told.err
    after = (session / "session.yaml").read_text(encoding="utf-8")

    def plain(text: str) -> str:
        return re.sub(r" +#", " #", re.sub(r"(_deg|_m): [-0-9.]+", r"\1: NUMBER", text))

    ours = re.compile(r" {4}(mount_origin: \{.*\}|mount: \{.*\}|mount_covariance:|    - \[.*e.*\])\n")
    left = "".join(line for line in after.splitlines(keepends=True) if not ours.fullmatch(line))
    assert plain(left) == plain(STYLES.replace("name:  ", "name: ").replace("format :", "format:"))
    assert after.index("mount_covariance") < after.index("# The sonar")
    content, new = yaml.safe_load(STYLES), yaml.safe_load(after)
    assert list(new) == list(content)
    assert list(new["laser"]) == [*content["laser"], "mount_origin", "mount_covariance"]
    assert list(new["mbes"]) == ["svp", "format", "mount", "mount_origin", "mount_covariance", "files"]


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
