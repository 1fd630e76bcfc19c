"""The tutorial, command by command: each does what the page says it does. And the demo says what two pages print."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from tests.support.effort import THOROUGH
from tests.support.places import SMALL, Told, edit, poolcal, result_of
from tests.support.roots import ROOT

TUTORIAL = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
BLOCKS = re.compile(r"(?:^    \S.*\n)+", re.MULTILINE)
FENCED = re.compile(r"^```yaml\n(.*?)^```", re.MULTILINE | re.DOTALL)
SESSION = Path("runs/day1/session.yaml")
SEED = re.findall(r"^SEED +:?= *(\d+)", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)[0]


class Reader:
    """Someone who types one line of the tutorial after the other."""

    def __init__(self) -> None:
        self.lines = iter([line.strip() for block in BLOCKS.findall(TUTORIAL) for line in block.splitlines()])

    def types(self, *expected: str) -> Told:
        """The next command; it must begin with these words of poolcal."""
        line = next(self.lines)
        while not line.startswith(".venv/bin/poolcal"):
            words = shlex.split(line.replace(".venv/bin/python", sys.executable))
            subprocess.run(words, check=True, env=os.environ | {"PYTHONPATH": str(ROOT)})
            line = next(self.lines)
        words = shlex.split(line)[1:]
        assert tuple(words[: len(expected)]) == expected
        return poolcal(*_smaller(words))


def _smaller(words: list[str]) -> list[str]:
    """In a usual run of the suite simulated sessions are small."""
    if THOROUGH or words[0] != "simulate":
        return words
    given = words.index("--scenario") + 1 if "--scenario" in words else 0
    if given and words[given] == "dock":
        return words
    content = yaml.safe_load(Path(words[given]).read_text(encoding="utf-8")) if given else {}
    path = Path("runs/small.yaml")
    path.parent.mkdir(exist_ok=True)
    path.write_text(yaml.safe_dump(SMALL | content | {"mbes": SMALL["mbes"] | content.get("mbes", {})}), "utf-8")
    return [word for place, word in enumerate(words) if not given or place not in (given, given - 1)] + [
        "--scenario", str(path)
    ]  # fmt: skip


def _ok(told: Told) -> str:
    assert told.status == 0, told.err
    return told.out


def _verdicts(told: Told) -> Iterator[str]:
    return (word for word in ("ACCEPTED", "REJECTED") if word in told.out)


def test_the_tutorial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    reader = Reader()
    _ok(reader.types("simulate", "runs/day1"))
    assert "FILL_IN" not in SESSION.read_text(encoding="utf-8")
    begun = _ok(reader.types("init", "runs/day1"))
    assert "Left to be done" in begun
    assert SESSION.read_text(encoding="utf-8").count(": FILL_IN") == 12  # two mounts
    assert Path("runs/day1/pool.yaml").read_text(encoding="utf-8").count(": FILL_IN") >= 7  # letters, origin

    subprocess.run(shlex.split(next(reader.lines)), check=True)  # the values put aside
    edit(SESSION, "mbes", mount={"roll_deg": 48.0})
    wrong = reader.types("check", "runs/day1")
    assert wrong.status == 1
    assert "mbes.mount.roll_deg = -48" in wrong.out
    edit(SESSION, "mbes", mount={"roll_deg": -48.0})
    assert "Nothing found." in _ok(poolcal("check", "runs/day1", "--config", "runs/day1/pool.yaml"))

    assert [*_verdicts(reader.types("run", "runs/day1"))] == ["ACCEPTED"]
    assert "every error is within 4 sigma" in _ok(reader.types("compare", "runs/tutorial1"))

    shutil.copytree("runs/tutorial1", "runs/kept")
    edit(SESSION, "mbes", latency_s=0.010)
    late = reader.types("run", "runs/day1")
    assert (late.status, [*_verdicts(late)]) == (1, ["REJECTED"])
    reason = result_of(Path("runs/tutorial1"))["reasons"][0]
    named = re.search(r"the sonar's clock: its latency is (-?[\d.]+) ± ([\d.]+) ms more", reason)
    assert named is not None, reason
    assert abs(float(named[1]) + 10) <= 2 * float(named[2])
    assert Path("runs/tutorial1/report.1/calibration.json").is_file()
    edit(SESSION, "mbes", latency_s=0.0)
    shutil.rmtree("runs/tutorial1")
    Path("runs/kept").rename("runs/tutorial1")
    again = poolcal("run", "runs/day1", "--config", "runs/day1/pool.yaml", "--run", "runs/tutorial1")
    assert (again.status, again.ran) == (0, [])  # as it was, and as the first run left it

    (knocked,) = FENCED.findall(TUTORIAL)
    Path("runs/knocked.yaml").write_text(knocked, encoding="utf-8")
    _ok(reader.types("simulate", "runs/day2"))
    _ok(reader.types("run", "runs/day2"))
    moved = reader.types("diff", "runs/tutorial1", "runs/tutorial2")
    assert moved.status == 1
    assert re.search(r"has moved.*roll", moved.out), moved.out
    _ok(poolcal("history", "runs"))

    assert "Roll" in _ok(reader.types("export", "runs/tutorial2"))
    practised = reader.types("check-entry", "runs/tutorial2")
    assert practised.status == 1
    assert practised.out.startswith("Not entered rightly: angles: yaw has the opposite sign.")
    if THOROUGH:
        _ok(reader.types("simulate", "runs/dock"))
        assert [*_verdicts(reader.types("run", "runs/dock"))] == ["ACCEPTED"]
        assert next(reader.lines, None) is None


@pytest.mark.thorough
def test_the_demo_prints_what_two_pages_show(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    _ok(poolcal("simulate", "runs/demo-session", "--seed", SEED))
    words = ("run", "runs/demo-session", "--config", "runs/demo-session/pool.yaml", "--run", "runs/demo")
    told = _ok(poolcal(*words, "--report", "--recordings"))
    told += _ok(poolcal("compare", "runs/demo", "runs/demo-session.truth.json"))
    printed = {" ".join(line.replace(".venv/bin/", "").split()) for line in told.splitlines()}
    for page, name in (("README.md", "answer"), ("docs/quickstart.md", "demo")):
        text = (ROOT / page).read_text(encoding="utf-8")
        block = text.partition(f"<!-- {name} -->")[2].partition(f"<!-- /{name} -->")[0]
        shown = {" ".join(line.replace(".venv/bin/", "").split()) for line in block.splitlines() if line[:4] == " " * 4}
        assert shown, page
        assert shown - printed == set(), page
