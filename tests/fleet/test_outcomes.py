"""Statuses, answers and the table: nothing that may not be used is shown as a value."""

import re
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pipeline.fleet.answer import (
    ACCEPTED,
    BUG,
    COULD_NOT_RUN,
    REJECTED,
    Answer,
    answer_about,
    answer_of_ended,
    overall_status,
)
from pipeline.fleet.logs import log_of, write_log
from pipeline.fleet.session_list import FleetSession
from pipeline.fleet.table import Outcome, count_line, outcome_table
from pipeline.language.letters import width

MOUNT = {"roll_deg": -48.81, "pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.3, "y_m": 0.2, "z_m": -2.01}


def _result(**changes: Any) -> dict[str, Any]:
    return {"verdict": "accepted", "reasons": [], "mbes": {"mount": MOUNT}} | changes


def test_values_of_an_accepted_result_alone() -> None:
    assert answer_about(_result(), ["adjust"], []) == Answer(ACCEPTED, ["adjust"], verdict="accepted", mount=MOUNT)
    rejected = answer_about(_result(verdict="rejected", reasons=["roll is weak", "b", "c"]), [], ["report.html"])
    assert (rejected.status, rejected.mount, rejected.verdict) == (REJECTED, {}, "rejected")
    assert rejected.reason == "roll is weak; and 2 other reasons"
    part = _result(calibrated="laser", laser={"mount": MOUNT}, held={"yaw": 0.1, "x": 0.02})
    answer = answer_about(part, [], [])
    assert (answer.status, answer.verdict) == (ACCEPTED, "accepted in part")
    assert answer.mount == {key: value for key, value in MOUNT.items() if key not in ("yaw_deg", "x_m")}


def test_an_answer_survives_its_line() -> None:
    answer = Answer(COULD_NOT_RUN, ["ingest"], 'a "b"\n水池 \udcff', "", MOUNT, ["recordings"])
    line = answer.as_line()
    assert "\n" not in line
    assert Answer.from_line(line) == answer


@pytest.mark.parametrize(
    ("exit_code", "status", "words"),
    [
        (-signal.SIGKILL, COULD_NOT_RUN, "ended from outside (SIGKILL); is memory short?"),
        (-signal.SIGTERM, COULD_NOT_RUN, "SIGTERM"),
        (-signal.SIGSEGV, BUG, "its process crashed (SIGSEGV)"),
        (-signal.SIGABRT, BUG, "SIGABRT"),
        (-100, BUG, "signal 100"),
        (130, COULD_NOT_RUN, "interrupted"),
        (0, BUG, "ended with status 0"),
        (7, BUG, "ended with status 7"),
    ],
)
def test_a_process_that_ended_without_an_answer(exit_code: int, status: int, words: str) -> None:
    answer = answer_of_ended(exit_code)
    assert answer.status == status
    assert words in answer.reason


@pytest.mark.parametrize(
    ("statuses", "overall"), [([0, 0], 0), ([0, 1, 0], 1), ([1, 2, 0], 2), ([2, 3, 1], 3), ([3], 3)]
)
def test_the_worst_decides(statuses: list[int], overall: int) -> None:
    assert overall_status([Answer(status) for status in statuses]) == overall


@pytest.fixture
def outcomes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Outcome]:
    monkeypatch.chdir(tmp_path)
    stages = ["ingest", "georeference", "segment", "fit_planes"]
    answers = {
        "good": Answer(ACCEPTED, [], verdict="accepted", mount=MOUNT),
        "part": Answer(ACCEPTED, ["adjust", "report"], verdict="accepted in part", mount={"roll_deg": -0.00001}),
        "bad": Answer(REJECTED, stages, "roll is weak", "rejected", not_drawn=["report.html"]),
        "lost": Answer(COULD_NOT_RUN, reason="ins/0.gps: cannot be read; copy it again"),
        "broken": Answer(BUG, reason="ZeroDivisionError: a"),
    }
    here = Path.cwd()
    return [
        Outcome(FleetSession(here / "data" / name, here / "p.yaml", here / "runs" / name, "mbes", 0), answer, 1.25)
        for name, answer in answers.items()
    ]


def test_the_table_shows_what_may_be_used_and_below_it_why_not(outcomes: list[Outcome]) -> None:
    here = Path.cwd()
    moved = {here / "runs" / "good": "moved: roll, yaw", here / "runs" / "lost": "no movement shown"}
    lines = outcome_table(outcomes, moved)
    cells = [re.split(r"  +|(?<=\S) (?=[-\d])|(?<=data/good) |(?<=data/part) ", line) for line in lines]
    assert lines[0].index("roll, °") + len("roll, °") == lines[1].index("-48.8100") + len("-48.8100")
    good = ["-48.8100", "1.2000", "-2.0000", "0.300", "0.200", "-2.010"]
    assert cells[1:6] == [
        ["data/good", "accepted", *good, "moved: roll, yaw"],
        ["data/part", "in part", "-0.0000", *"-----", "-"],
        ["data/bad", "rejected", *"------", "-"],
        ["data/lost", "refused", *"------", "-"],
        ["data/broken", "bug", *"------", "-"],
    ]
    assert lines[6:] == [
        "",
        "data/good: has moved since the session before: roll, yaw",
        "data/bad: rejected: roll is weak",
        "data/bad: report.html not drawn",
        "data/lost: refused: ins/0.gps: cannot be read; copy it again",
        "data/broken: bug: ZeroDivisionError: a; see runs/broken.repeat.log",
    ]


def test_what_was_accepted_for_one_kind_of_survey_says_so_below_the_table(outcomes: list[Outcome]) -> None:
    answer = answer_about(_result(limits={"in_words": "Order 1a (IHO S-44) down to 12 m, beams to 50°"}), [], [])
    outcome = replace(outcomes[0], answer=answer)
    table = outcome_table([outcome], {})
    assert table[1].split()[:2] == ["data/good", "accepted"]
    assert table[2:] == ["", "data/good: accepted for Order 1a (IHO S-44) down to 12 m, beams to 50°"]
    assert outcome.line.startswith("data/good: accepted for Order 1a (IHO S-44) down to 12 m, beams to 50°; up to date")


@pytest.mark.parametrize(("since", "shown"), [("no movement shown", "no movement shown"),
                                              ("moved: pitch, roll, yaw, x", "moved")])  # fmt: skip
@pytest.mark.parametrize("name", ["a" * 60 + "2026-05-12", "水池" * 20 + "2026-05-12"])
def test_the_table_is_a_hundred_columns_wide_at_most(
    name: str, since: str, shown: str, outcomes: list[Outcome]
) -> None:
    """With long names of sessions, of letters that take two columns too, and the widest values."""
    here = Path.cwd()
    mount = {"roll_deg": -179.9999, "pitch_deg": -80.0, "yaw_deg": -179.9999, "x_m": -12.345, "y_m": -12.345, "z_m": -9}
    session = FleetSession(here / "data" / name, here / "p.yaml", here / "runs" / "a", "mbes", 0)
    answer = Answer(ACCEPTED, [], verdict="accepted", mount=mount)
    table = outcome_table([Outcome(session, answer, 1.0), outcomes[1]], {here / "runs" / "a": since})[:3]
    assert max(map(width, table)) <= 100
    assert table[1].startswith("…")
    assert "2026-05-12 accepted" in " ".join(table[1].split())
    assert table[1].endswith(f" {shown}")


def test_boats_with_sessions_of_one_day_are_told_apart(outcomes: list[Outcome]) -> None:
    """The names differ only far in front: they get more room than the screen has, rather than one name for both."""
    here = Path.cwd()
    names = [f"data/{boat}/{'x' * 40}/2026-05-12" for boat in ("boat_a", "boat_b")]
    table = outcome_table(
        [replace(outcomes[0], session=FleetSession(here / name, here, here / name, "mbes", 0)) for name in names], {}
    )
    assert table[1].split()[0] != table[2].split()[0]
    assert [row.split()[0][:3] for row in table[1:3]] == ["…a/", "…b/"]


def test_lines_at_the_end_of_a_session_and_of_all(outcomes: list[Outcome]) -> None:
    assert [outcome.line for outcome in outcomes] == [
        "data/good: accepted; up to date (1.2 s)",
        "data/part: accepted in part; ran adjust, report (1.2 s)",
        "data/bad: rejected: roll is weak; ran ingest to fit_planes; report.html not drawn (1.2 s)",
        "data/lost: refused: ins/0.gps: cannot be read; copy it again (1.2 s)",
        "data/broken: bug: ZeroDivisionError: a; see runs/broken.repeat.log (1.2 s)",
    ]
    counts = "2 accepted, 1 rejected, 1 could not run, 1 ended by a bug; 1 up to date"
    assert count_line(outcomes) == f"5 sessions: {counts}."
    assert count_line(outcomes[:1]) == "1 session: 1 accepted; 1 up to date."


def test_a_log_replaces_nothing_but_a_log(tmp_path: Path) -> None:
    run = tmp_path / "runs" / "a"
    assert write_log(run, "data/a", "one\n\x1b[2J\n") == ""
    assert log_of(run).read_text() == "poolcal repeat: data/a\none\n\\x1b[2J\n"
    assert write_log(run, "data/a", "two\n") == ""
    assert log_of(run).read_text() == "poolcal repeat: data/a\ntwo\n"
    log_of(run).write_text("#BESTPOS")
    assert "poolcal did not write it" in write_log(run, "data/a", "three\n")
    assert log_of(run).read_text() == "#BESTPOS"
    assert list(tmp_path.rglob("*.new")) == []
    (tmp_path / "file").touch()
    assert "cannot be written" in write_log(tmp_path / "file" / "a", "data/a", "")
