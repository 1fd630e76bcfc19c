"""Which sessions FLEET.yaml stands for, and where each goes; what would mix two of them up is refused."""

from pathlib import Path

import pytest

from pipeline.config.fleet import load_fleet
from pipeline.errors import ConfigError
from pipeline.fleet.session_list import SessionList, list_sessions


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """Two boats with two sessions each; a folder and a file that are none."""
    root = tmp_path / "水池 [1]"  # no pattern, though it looks like one
    for name in ("boat_a/05-12", "boat_a/05-13", "boat_b/05-12", "boat_b/05-20"):
        (root / "data" / name).mkdir(parents=True)
        (root / "data" / name / "session.yaml").touch()
    (root / "data" / "boat_a" / "05-14").mkdir()
    (root / "data" / "boat_a" / "05-notes.txt").touch()
    (root / "configs").mkdir()
    return root


def _listed(place: Path, text: str) -> SessionList:
    file = place / "configs" / "fleet.yaml"
    file.write_text(text, encoding="utf-8")
    return list_sessions(load_fleet(file))


def _refused(place: Path, text: str) -> str:
    with pytest.raises(ConfigError) as refused:
        _listed(place, text)
    return str(refused.value).removeprefix(f"{place}/configs/fleet.yaml: ").replace(f"{place}/", "")


def test_patterns_in_the_order_of_the_file_then_of_names(place: Path) -> None:
    listed = _listed(
        place,
        "runs: ../runs/a\n"
        "sessions:\n"
        "  - {session: ../data/boat_b/*, config: dock.yaml, runs: ../runs/b}\n"
        "  - {session: ../data/boat_a/05-*, config: pool.yaml}\n"
        f"  - {{session: '{place}/data/boat_a/05-12/', config: pool.yaml, run: ../laser, sensor: laser}}\n",
    )
    found = [(one.session, one.config.name, one.run, one.sensor) for one in listed.sessions]
    assert found == [
        (place / "data/boat_b/05-12", "dock.yaml", place / "runs/b/05-12", "mbes"),
        (place / "data/boat_b/05-20", "dock.yaml", place / "runs/b/05-20", "mbes"),
        (place / "data/boat_a/05-12", "pool.yaml", place / "runs/a/05-12", "mbes"),
        (place / "data/boat_a/05-13", "pool.yaml", place / "runs/a/05-13", "mbes"),
        (place / "data/boat_a/05-12", "pool.yaml", place / "laser", "laser"),
    ]
    assert listed.sessions[0].config.parent == place / "configs"
    assert listed.passed_over == (place / "data/boat_a/05-14",)
    assert listed.sessions[4].label.endswith("data/boat_a/05-12 (laser)")


def test_names_from_the_working_folder(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "runs: ../runs\nsessions:\n  - {session: ../data/boat_a/05-12, config: a}\n"
    monkeypatch.chdir(place)
    assert _listed(place, text).sessions[0].label == "data/boat_a/05-12"
    monkeypatch.chdir(place / "configs")
    assert _listed(place, text).sessions[0].label == str(place / "data/boat_a/05-12")


def test_a_folder_of_that_name_goes_before_the_pattern(place: Path) -> None:
    odd = place / "data" / "boat_b" / "05-[12]*"
    odd.mkdir()
    (odd / "session.yaml").touch()
    listed = _listed(place, "runs: ../runs\nsessions:\n  - {session: '../data/boat_b/05-[12]*', config: a}\n")
    assert [one.run for one in listed.sessions] == [place / "runs" / "05-[12]*"]


def test_a_link_keeps_its_own_name(place: Path) -> None:
    (place / "disk7").mkdir()
    (place / "disk7" / "session.yaml").touch()
    (place / "data" / "boat_c").mkdir()
    (place / "data" / "boat_c" / "06-01").symlink_to(place / "disk7")
    text = "runs: ../runs\nsessions:\n  - {session: ../data/boat_c/*, config: a}\n"
    assert _listed(place, text).sessions[0].run == place / "runs" / "06-01"
    assert "lies in the session folder disk7, or round it" in _refused(place, text.replace("../runs", "../disk7"))


SESSIONS = "sessions:\n  - {session: ../data/boat_a/05-12, config: a}\n  - {session: ../data/%s, config: a%s}\n"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "runs: ../runs\n" + SESSIONS % ("boat_b/05-12", ""),
            "line 4: sessions.1.session = '../data/boat_b/05-12': data/boat_b/05-12 would go into runs/05-12, as "
            "data/boat_a/05-12 in line 3 does; give one of them another run or runs",
        ),
        (
            "runs: ../runs\n" + SESSIONS % ("boat_b/05-20", ", run: ../configs/../runs/05-12"),
            "line 4: sessions.1.run = '../configs/../runs/05-12': data/boat_b/05-20 would go into runs/05-12, as",
        ),
        (
            "runs: ../runs\n" + SESSIONS % ("boat_c/*", ""),
            "line 4: sessions.1.session = '../data/boat_c/*': matches no folder that holds session.yaml; correct",
        ),
        (
            "runs: ../runs\n" + SESSIONS % ("boat_a/05-14", ""),
            "line 4: sessions.1.session = '../data/boat_a/05-14': matches no folder that holds session.yaml; correct",
        ),
        (SESSIONS % ("boat_b/05-12", ""), "line 2: sessions.0.run: is missing; add it, or runs for all sessions"),
        (
            "runs: ../runs\n" + SESSIONS % ("boat_b/*", ", run: ../x"),
            "line 4: sessions.1.run = '../x': is one run folder for several sessions, data/boat_b/05-12 and "
            "data/boat_b/05-20; write runs instead",
        ),
        (
            "runs: ../runs\n" + SESSIONS % ("boat_b/05-20", ", runs: ../data/boat_a/05-12"),
            "line 4: sessions.1.runs = '../data/boat_a/05-12': data/boat_a/05-12/05-20 lies in the session folder "
            "data/boat_a/05-12, or round it; name one apart",
        ),
        (
            "runs: ../runs\n" + SESSIONS % ("boat_b/05-20", ", run: ../data/boat_b"),
            "line 4: sessions.1.run = '../data/boat_b': data/boat_b lies in the session folder data/boat_b/05-20, or",
        ),
        (
            "runs: ../runs\n" + SESSIONS % ("boat_b/05-20", ", run: ../runs/05-12/adjust"),
            "line 4: sessions.1.run = '../runs/05-12/adjust': runs/05-12/adjust lies in another run folder, runs/05-12",
        ),
        (
            "runs: ../runs\n" + SESSIONS % ("boat_b/05-20", ", run: ../runs/history"),
            "line 4: sessions.1.run = '../runs/history': runs/history is where the history page goes; name another",
        ),
    ],
)
def test_refused_before_anything_runs(text: str, line: str, place: Path) -> None:
    told = _refused(place, text)
    assert told.startswith(line), told
    assert not (place / "runs").exists()
