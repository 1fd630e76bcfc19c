"""The session.yaml that ``poolcal coarse`` replaces: twice is once, the one before is kept, a full disk."""

import errno
import os
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.support.marks import PLAIN, marks_of, mounts_in, run
from tests.support.surveys import World


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
