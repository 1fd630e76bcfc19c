"""In Chinese nothing stays English: pages, pictures and screen of runs, laser runs, check, diff and history."""

import shutil
from pathlib import Path

import pytest

from pipeline.config.about import About
from pipeline.results.pages.rendering import fonts_of
from stages.commands.draw import Drawings, draw_missing
from tests.support.left_english import assert_chinese, texts_of_page, watch_pictures
from tests.support.places import Place, Told, poolcal
from tests.support.planted_runs import planted

NAMES = ("undisturbed", "session", "small", "2026-05-12_small", "runs/a")


@pytest.fixture(autouse=True)
def chinese(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POOLCAL_LANG", "zh")


def drawn(run: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The texts of a run's report in Chinese, and of its pictures where this machine has Chinese letters."""
    pictures = watch_pictures(monkeypatch)
    (run / "report" / "report.html").unlink(missing_ok=True)
    assert draw_missing(run, Drawings(report=True, recordings=False)) == []
    return texts_of_page(run / "report" / "report.html") + (pictures if fonts_of("zh") else [])


def screen(told: Told) -> list[str]:
    return [*told.out.splitlines(), *told.complaints]


def test_an_accepted_run(done: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    done.edit_session("", about={key: "甲" for key in About.model_fields if key != "instruments"})
    told = poolcal(*done.words())
    assert told.status == 0
    assert_chinese(screen(told) + drawn(done.run, monkeypatch), done.folder, *NAMES)


def test_a_rejected_run(done: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    done.edit_config("verdict", max_sigma_deg=1e-6)
    told = done.calibrate()
    assert told.status == 1
    assert_chinese(screen(told) + drawn(done.run, monkeypatch), done.folder, *NAMES)


def test_a_laser_run(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    told = poolcal("laser", *place.words()[1:], "--no-report", "--no-recordings", "--no-write")
    assert told.status in (0, 1), told.err
    assert_chinese(screen(told) + drawn(place.run, monkeypatch), place.folder, *NAMES)


def test_a_check_with_findings(place: Place) -> None:
    place.edit_session("mbes", latency_s=0.5)
    place.edit_session("laser", gps_week=2400)
    told = poolcal("check", place.session, "--config", place.config)
    assert told.status == 1, told.err
    assert_chinese(screen(told), place.folder, *NAMES)


def test_two_runs_and_many(done: Place, undisturbed: tuple[Path, Told], monkeypatch: pytest.MonkeyPatch) -> None:
    done.edit_config("verdict", max_sigma_deg=0.06)
    assert done.calibrate().status == 0
    pictures = watch_pictures(monkeypatch)
    folder = done.folder / "runs"
    for day, shift in enumerate((0.0, 0.0, 0.06, 0.06), 1):
        planted(folder, done.run, f"run{day}", day, z_m=shift)
    planted(folder, done.run, "refused", 5, verdict="rejected", nothing=True)
    page, before = done.folder / "diff.html", done.folder / "甲"  # a name that is no English word
    shutil.copytree(undisturbed[0], before)
    texts = screen(poolcal("diff", before, done.run, "--html", page))
    texts += screen(poolcal("history", folder)) + texts_of_page(folder / "history" / "history.html")
    texts += texts_of_page(page) + (pictures if fonts_of("zh") else [])
    assert_chinese(texts, done.folder, *NAMES, "run1", "run2", "run3", "run4", "refused")
