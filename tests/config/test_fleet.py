"""FLEET.yaml: what it may say, and the one line about what it may not, with the line of the file."""

from pathlib import Path

import pytest

from pipeline.config.fleet import load_fleet
from pipeline.errors import ConfigError
from tests.support.roots import CONFIGS


def test_the_example_loads() -> None:
    listed = load_fleet(CONFIGS / "fleet.yaml").fleet.sessions
    assert [one.sensor for one in listed] == ["mbes", "mbes", "laser"]
    assert [one.runs is None for one in listed] == [True, False, True]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "sessions:\n  - session: a\n    confg: b\n",
            "line 3: sessions.0.confg: unknown key; is it config? known here: config, run, runs, sensor, session",
        ),
        ("session:\n  - {session: a, config: b}\n", "line 1: session: unknown key; is it sessions? known"),
        ("runs: a\nsessions:\n  - {session: a}\n", "line 3: sessions.0.config: is missing; add it"),
        ("runs: a\nsessions: []\n", "line 2: sessions = []: has too few entries: 0 of at least 1; correct"),
        ("sessions: a\n", "line 1: sessions = 'a': input should be a list, in square brackets; correct this value"),
        (
            "sessions:\n\n  - {session: a, config: b}\n  - session: a\n    config: b\n    sensor: sonar\n",
            "line 6: sessions.1.sensor = 'sonar': input should be 'mbes' or 'laser'; correct this value",
        ),
        ("sessions:\n  - {session: '', config: b}\n", "line 2: sessions.0.session = '': string should have at least"),
        ('sessions:\n  - {session: "a\\0", config: b}\n', "sessions.0.session = 'a\\x00': must have no control"),
        ("sessions:\n  - {session: 2026, config: b}\n", "sessions.0.session = 2026: should be text: put it in quotes"),
        (
            "sessions:\n  - session: a\n    config: b\n    run: c\n    runs: d\n",
            "line 2: sessions.0 = {'session': 'a', 'config': 'b', 'run': 'c', 'runs': 'd'}: has both run and runs;",
        ),
        ("sessions:\n  - {session: a, session: b}\n", "key 'session' is given twice"),
        ("sessions: *a\n", "aliases (*name) are not accepted"),
        ("sessions: [\n", "not valid YAML"),
        ("", "is empty"),
    ],
)
def test_one_line_says_where_and_what(text: str, line: str, tmp_path: Path) -> None:
    file = tmp_path / "车队.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as refused:
        load_fleet(file)
    told = str(refused.value)
    assert told.startswith(f"{file}: ")
    assert line in told
    assert "\n" not in told
