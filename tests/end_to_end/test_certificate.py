"""The report begins with a certificate: identity, values, soundings, conditions, digests; and `poolcal report`."""

import hashlib
import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline.results.pages.limiting_errors import IN_WORDS
from stages.commands.draw import Drawings, draw_missing
from tests.support.pages import Page, assert_self_contained
from tests.support.places import Place, Told, digests, edit, poolcal, result_of
from tests.support.weak_sessions import only_the_wall

ABOUT: dict[str, Any] = {
    "vessel": "海测 7 <img src=x onerror=alert(1)>",
    "client": "A & B \"Ports\"",
    "surveyor": "Wang Li",
    "epoch": "2026.4",
    "ins_reference_point": "centre of the IMU",
    "instruments": {"mbes": {"make": "R2Sonic", "model": "2024", "serial": "<b>101</b>"}},
}
SIGNS = ("starboard down", "bow up", "to port", "to starboard", "forward", "up")
MARK = "REJECTED — not a certificate"


def html_of(run: Path) -> str:
    return (run / "report" / "report.html").read_text(encoding="utf-8")


def flat(html: str) -> str:
    return " ".join(Page(html).text.split())


def drawn_again(run: Path) -> str:
    assert draw_missing(run, Drawings(report=True, recordings=False)) == []
    return html_of(run)


def test_an_accepted_run_has_a_certificate(undisturbed: tuple[Path, Told]) -> None:
    run = undisturbed[0]
    page, result = Page(html_of(run)), result_of(run)
    text = " ".join(page.text.split())
    begins = text.index("Calibration certificate")
    assert begins < text.index("accepted", begins) < text.index("Mount of the sonar") < text.index("limits each value")
    assert MARK not in text
    block = result["mbes"]
    rows = page.table("value", "positive")
    assert [(row[0], row[1]) for row in rows] == list(zip(("roll", "pitch", "yaw", "x", "y", "z"), SIGNS, strict=True))
    for (_, _, value, within), key in zip(rows, block["mount"], strict=True):
        angle = key.endswith("_deg")
        shown, unit = value.split()
        half, unit_of_half = within.removeprefix("± ").split()
        assert (unit, unit_of_half) == (("°", "°") if angle else ("m", "mm"))
        assert float(shown) == pytest.approx(block["mount"][key], abs=5.1e-4 if angle else 5.1e-5)
        half_width = 1.96 * block["sigma_mount_total"][key] * (1 if angle else 1000)
        assert float(half) == pytest.approx(half_width, abs=5.1e-4 if angle else 0.051)
    assert [row[0] for row in page.table("", "name", "date")] == ["evaluated by", "approved by"]
    assert "poolcal is not yet proven on a real calibration" in text
    speed = re.search(r"The values were found at ([\d.]+) m/s \(([\d.]+) kn\)", text)
    assert speed is not None
    assert float(speed[1]) == pytest.approx(0.4, abs=0.051)
    assert float(speed[2]) == pytest.approx(0.4 / 0.5144, abs=0.051)


def test_the_sentence_names_the_largest_row_of_the_composition(undisturbed: tuple[Path, Told]) -> None:
    page = Page(html_of(undisturbed[0]))
    rows = page.table("", "roll, °", "pitch, °")
    roll = {row[0]: float(row[1]) for row in rows}
    largest = max(roll, key=lambda name: roll[name])
    text = " ".join(page.text.split())
    sentence = text[text.index("Roll is known to ") : text.index("Pitch is known to ")]
    assert f"comes from {': '.join(IN_WORDS[largest.removesuffix(' (the random sigma)')])}." in sentence
    most = roll[largest] ** 2 > 0.5 * np.sum(np.square(list(roll.values())))
    assert ("most of that" in sentence) == most


def test_soundings_by_the_results_covariance(undisturbed: tuple[Path, Told]) -> None:
    """Straight down, 50 m: height by the lever arm alone; the largest of the plane's sigmas, by hand, for the rest."""
    run = undisturbed[0]
    rows = {row[0]: row[1:] for row in Page(html_of(run)).table("depth below the sonar", "straight down")}
    assert list(rows) == ["5 m", "10 m", "20 m", "50 m"]
    C = np.array(result_of(run)["mbes"]["covariance_total"])
    vertical, horizontal = (float(number) for number in rows["50 m"][0].split(" / "))
    assert vertical == pytest.approx(1960 * np.sqrt(C[5, 5]), abs=0.51)
    across = C[3, 3] + 2500 * C[1, 1] - 100 * C[1, 3]  # roll + shifts a sounding below to port: v = -50 z, ε × v
    along = C[4, 4] + 2500 * C[0, 0] + 100 * C[0, 4]
    assert horizontal >= 2447 * np.sqrt(max(across, along)) - 0.51
    assert horizontal <= 2448 * np.sqrt(across + along)
    assert [row[3:] for row in rows.values()] == [["253", "155"], ["261", "168"], ["292", "212"], ["451", "404"]]


@pytest.mark.usefixtures("unpainted")
def test_digests_are_of_the_files_themselves(done: Place) -> None:
    assert done.calibrate("--report").status == 0
    rows = dict(_digest_rows(done.run))

    def sha256(content: bytes) -> str:
        return hashlib.sha256(content).hexdigest()

    raw = sorted(path for sensor in ("ins", "laser", "mbes") for path in (done.session / sensor).iterdir())
    lines = [f"{sha256(path.read_bytes())}  {path.relative_to(done.session).as_posix()}\n" for path in raw]
    assert rows[f"raw files, all {len(raw)}"] == sha256("".join(lines).encode())
    assert rows["session.yaml"] == sha256((done.session / "session.yaml").read_bytes())
    assert rows["the pool's config"] == sha256(done.config.read_bytes())
    assert rows["calibration.json"] == sha256((done.run / "report" / "calibration.json").read_bytes())


def _digest_rows(run: Path) -> list[list[str]]:
    (found,) = [table for table in Page(html_of(run)).tables if table[0][0].startswith("raw files, all")]
    return found


@pytest.mark.usefixtures("unpainted")
def test_about_is_text_and_makes_nothing_stale(done: Place, right: dict[str, str]) -> None:
    assert "vessel not stated" in flat(drawn_again(done.run))
    done.edit_session("", about=ABOUT)
    told = done.calibrate("--report")
    assert (told.status, told.ran) == (0, [])
    assert digests(done.run) == right
    html = html_of(done.run)
    page = Page(html)
    assert_self_contained(page)
    text = " ".join(page.text.split())
    assert "海测 7 <img src=x onerror=alert(1)>" in text
    assert "<img src=x" not in html
    assert 'A & B "Ports"' in text
    assert "the INS (centre of the IMU)" in text
    assert ["sonar", "R2Sonic 2024", "<b>101</b>", "not stated"] in page.table("instrument", "make and model")
    assert page.table("", "name", "date")[0][1] == "Wang Li"
    assert "epoch 2026.4" in text
    assert "report number not stated" in text
    assert "about." not in "".join(row[1] for row in page.table("from", "key", "value"))


@pytest.mark.usefixtures("unpainted")
def test_a_rejected_run_is_marked_and_has_no_line_to_sign(done: Place) -> None:
    done.edit_config("verdict", max_sigma_deg=1e-6)
    assert done.calibrate("--report").status == 1
    html = html_of(done.run)
    page = Page(html)
    text = " ".join(page.text.split())
    assert text.count(MARK) == 2  # on both of its sheets
    assert "Calibration record: rejected, not a certificate" in text
    assert "Calibration certificate" not in text
    assert page.table("value", "positive", "computed, not to be used")
    classes = [attributes.get("class") or "" for attributes in page.named("table")]
    assert "whole values quiet" in classes
    assert not any("signatures" in one for one in classes)
    assert "This run is rejected: the uncertainties on this sheet" in text
    for promise in ("The values hold until", "the mount takes at most", "before you rely on", "they replace"):
        assert promise not in text


@pytest.mark.usefixtures("unpainted")
def test_words_of_the_crew_stay_as_they_are_in_another_language(done: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    """A vessel may be called by a word of the catalogue."""
    monkeypatch.setenv("POOLCAL_LANG", "zh")
    words = {"make": "sonar", "model": "up", "serial": "forward", "firmware": "accepted", "remarks": "pool"}
    about = {"vessel": "pool", "surveyor": "roll", "approved_by": "yaw", "instruments": {"mbes": words}}
    done.edit_session("", name="laser", about=about)
    assert done.calibrate("--report").status == 0
    page = Page(html_of(done.run))
    assert page.headings[0] == "laser"
    assert "船名 pool" in " ".join(page.text.split())
    assert ["声呐", "sonar up; pool", "forward", "accepted"] in page.table("仪器")
    assert [row[1] for row in page.table("", "名称", "日期")] == ["roll", "yaw"]


def test_without_a_solution_there_are_dashes(small: Path, tmp_path: Path) -> None:
    place = only_the_wall(small, tmp_path)
    told = place.calibrate("--report")
    assert (told.status, told.complaints) == (1, [])
    page = Page(html_of(place.run))
    assert [row[2:] for row in page.table("value", "positive")] == [["–", "–"]] * 6
    text = " ".join(page.text.split())
    assert "There is no solution, and so no uncertainty." in text
    for nothing in ("What it means for soundings", "Assumed, not stated", "were found at", "The uncertainties"):
        assert nothing not in text
    untold = text[text.index("The points tell nothing of: ") :].partition(". ")[0].split("; ")
    assert len({*untold}) == len(untold)
    assert not re.search(r"\bnan\b", text.lower())


@pytest.mark.usefixtures("unpainted")
def test_a_method_without_sigmas_gives_no_certificate(done: Place) -> None:
    done.edit_config("", result="patent_alternating")
    status = done.calibrate("--report").status
    text = flat(html_of(done.run))
    assert "Calibration certificate" not in text
    if status == 0:
        assert "no certificate, for this method gives no uncertainties" in text
        assert "This method gives no uncertainties of its own." in text


@pytest.mark.usefixtures("unpainted")
def test_an_older_run_folder_says_what_it_does_not_know(done: Place) -> None:
    path = done.run / "run.yaml"
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    del content["files"]
    del content["stated"]
    del content["session"]["about"]
    path.write_text(yaml.safe_dump(content, allow_unicode=True), encoding="utf-8")
    page = Page(drawn_again(done.run))
    assert "This older run does not record which figures the crew stated." in " ".join(page.text.split())
    rows = dict(_digest_rows(done.run))
    assert rows["session.yaml"] == rows["the pool's config"] == "not recorded by the version that made this run"


def test_the_front_says_the_result_and_the_appendix_the_rest(undisturbed: tuple[Path, Told]) -> None:
    headings = Page(html_of(undisturbed[0])).headings
    appendix = headings.index("Appendix: for experts")
    front, back = headings[:appendix], headings[appendix:]
    assert {"The sonar's mount", "Residuals", "Passes", "Data", "Provenance"} <= set(front)
    ways = "The same mount parameters in 4 ways"
    settings = "Settings that are not the defaults"
    assert {"Correlations", ways, "Agreement of the planes", "Points", settings} <= set(back)


def test_report_draws_the_page_and_changes_nothing_else(done: Place, right: dict[str, str]) -> None:
    told = poolcal("report", done.run)
    assert (told.status, told.err) == (0, "")
    assert told.out == f"Report: {done.run / 'report' / 'report.html'}\n"
    assert digests(done.run) == right
    assert poolcal("verify", done.run).status == 0


def test_report_refuses_what_is_not_finished(done: Place, tmp_path: Path) -> None:
    pdf = tmp_path / "out.pdf"
    cases: list[tuple[Path, Path, str]] = [
        (tmp_path / "nowhere", pdf, "holds no run.yaml"),
        (done.run, tmp_path / "out.html", "name a file that ends in .pdf"),
        (done.run, done.run / "report" / "report.pdf", "lies in the folder"),
        (done.run, done.template / "report.pdf", "lies in the folder"),
        (done.run, tmp_path, "ends in .pdf"),
    ]
    mine = tmp_path / "mine.pdf"
    mine.write_text("my notes")
    cases.append((done.run, mine, "poolcal did not write it"))
    for run, file, words in cases:
        told = poolcal("report", run, "--pdf", file)
        assert (told.status, len(told.err.splitlines())) == (2, 1), told.err
        assert words in told.err
    assert mine.read_text() == "my notes"
    told = poolcal("report", done.run, "--certificate")
    assert (told.status, told.err.count("\n"), "add --pdf FILE" in told.err) == (2, 1, True)
    shutil.rmtree(done.run / "adjust")
    told = poolcal("report", done.run, "--pdf", pdf)
    assert (told.status, len(told.err.splitlines())) == (2, 1)
    assert "adjust is not finished" in told.err
    shutil.rmtree(done.run / "report")
    assert poolcal("report", done.run).status == 2
    assert not pdf.exists()


@pytest.mark.usefixtures("unpainted")
def test_names_that_came_after_the_run_are_not_left_out_in_silence(done: Place, tmp_path: Path) -> None:
    """session.yaml got its block about after the run: the page would show none of it."""
    pdf = tmp_path / "out.pdf"
    edit(done.run / "run.yaml", "", session_folder=str(done.session))
    assert poolcal("report", done.run).err == ""
    done.edit_session("about", client="Port of Qingdao")
    told = poolcal("report", done.run)
    assert told.status == 0
    assert "session.yaml: about has changed since the run" in told.err
    told = poolcal("report", done.run, "--pdf", pdf)
    assert (told.status, len(told.err.splitlines()), pdf.exists()) == (2, 1, False)
    assert "poolcal run again" in told.err
    done.edit_session("about", client=None, custommer="Port of Qingdao")  # misspelt: it is not left out either
    assert poolcal("report", done.run, "--pdf", pdf).status == 2
    done.edit_session("", about=None)
    done.edit_session("mbes", mount={"x_m": 0.37})  # as poolcal laser writes the mount that it found
    assert poolcal("report", done.run).err == ""
    (done.session / "session.yaml").unlink()  # the disk with the raw files is elsewhere
    assert poolcal("report", done.run).err == ""


def test_a_run_yaml_that_was_edited_is_refused(done: Place) -> None:
    path = done.run / "run.yaml"
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    for files, words in (({"session": 1}, "files: must hold digests"), (None, "files: must hold digests")):
        path.write_text(yaml.safe_dump(content | {"files": files}), encoding="utf-8")
        told = poolcal("report", done.run)
        assert (told.status, len(told.err.splitlines())) == (2, 1)
        assert words in told.err
    path.write_text(json.dumps(content | {"more": 1}), encoding="utf-8")
    assert poolcal("report", done.run).status == 2
