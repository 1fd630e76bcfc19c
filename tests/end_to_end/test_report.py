"""RUN/report/report.html: its numbers are the run's, its texts are texts, and it is drawn when there is cause."""

import base64
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from stages import ORDER
from stages.commands.draw import Drawings, draw_missing
from tests.support.effort import often
from tests.support.pages import Page, assert_self_contained
from tests.support.places import Place, Told, digests, poolcal, result_of

HOSTILE = "<script>alert(1)</script> \"quotes\" '&amp;' 水池 ``` " + "x" * 240


def page_of(run: Path) -> Page:
    return Page((run / "report" / "report.html").read_text(encoding="utf-8"))


def test_verdict_first_then_the_runs_numbers(undisturbed: tuple[Path, Told]) -> None:
    run = undisturbed[0]
    page, result = page_of(run), result_of(run)
    assert page.headings[0] == result["session"]
    assert page.text.index("accepted") < page.text.index("roll")
    rows = page.table("", "coarse", "calibrated")
    table = pd.read_parquet(run / "report" / "calibration.parquet").query("method == 'adjustment'")
    signs = ("starboard down", "bow up", "to port", "to starboard", "forward", "up")
    named = zip(table["parameter"].tolist(), signs, strict=True)
    assert [row[0] for row in rows] == [f"{name} ({sign})" for name, sign in named]
    for row, values in zip(rows, table.to_dict("records"), strict=True):
        _, coarse, total, change, random, sigma, limit, interval = row
        low, high = interval.split(" … ")
        angle = values["unit"] == "deg"
        assert limit == ("0.050 °" if angle else "5.0 mm")
        assert f"{values['correction']:+.4f}" in page.text
        entered = {"coarse": coarse, "total": total, "low_95": low, "high_95": high}  # 0.001° and 0.0001 m
        small = {"change": change, "sigma_random": random, "sigma_total": sigma}  # 0.001° and 0.1 mm
        for key, shown in (entered | small).items():
            number, unit = shown.split()
            scale, said, digits = (1, "°", 3) if angle else (1, "m", 4) if key in entered else (1000, "mm", 1)
            assert (unit, len(number.partition(".")[2])) == (said, digits), key
            assert float(number) == pytest.approx(scale * values[key], abs=0.51 * 10**-digits), key
    matrix = result["geometry"]["correlation"]
    shown = page.table("correlation", "roll")
    assert float(shown[2][5]) == pytest.approx(matrix[2][4], abs=0.0051)  # yaw with y
    assert float(shown[0][2]) == pytest.approx(matrix[1][0], abs=0.0051)  # roll with pitch


def test_the_literal_form_stands_beside_the_others_with_its_warning(undisturbed: tuple[Path, Told]) -> None:
    page, methods = page_of(undisturbed[0]), result_of(undisturbed[0])["methods"]
    heads = "(0) patent, word for word", "(1) patent, angles, then offsets", "(2) patent, in turn", "(3) adjustment"
    rows = page.table("", *heads)
    for row, key in zip(rows, methods["patent_literal"]["mount"], strict=True):
        literal, adjusted = (methods[method]["mount"][key] for method in ("patent_literal", "adjustment"))
        assert float(row[1].split()[0]) == pytest.approx(literal, abs=5.1e-5)
        assert float(row[5].split()[0]) == pytest.approx(literal - adjusted, abs=5.1e-5)
    warning, steps = methods["patent_literal"]["warning"], methods["patent_literal"]["iterations"]
    assert methods["patent_literal"]["converged"]
    assert f" Form (0): {warning}. It converged in {steps} steps." in " ".join(page.text.split())


def test_files_counts_settings_and_origin_are_listed(undisturbed: tuple[Path, Told]) -> None:
    run = undisturbed[0]
    page, result = page_of(run), result_of(run)
    files = pd.read_parquet(run / "ingest" / "files.parquet")
    listed = page.table("sensor", "file", "records")
    assert [(row[1], int(row[2].replace(",", ""))) for row in listed] == list(
        zip(files["file"], files["records"], strict=True)
    )
    counts = pd.read_parquet(run / "segment" / "counts.parquet")
    seen = [row[1:] for row in page.table("stage", "points of") if row[0] == "segment"]
    assert sorted((a, b, int(n.replace(",", ""))) for a, b, n in seen) == sorted(
        ({"laser_pool": "laser", "soundings_pool": "mbes"}[source], reason, number)
        for source, reason, number in counts[["source", "reason", "count"]].itertuples(index=False, name=None)
        if number
    )
    changed = {row[1]: (row[0], *row[2:]) for row in page.table("from", "key", "value")}
    assert changed["target.a"] == ("pool", "8.0", "")
    assert changed["ins.drift.heading_deg"] == ("session", "0.0", "0.03")
    assert "segment.margin_m" not in changed
    assert dict(page.table("raw file", "SHA-256")) == result["inputs"]


def test_the_target_by_design_and_as_found(undisturbed: tuple[Path, Told]) -> None:
    run = undisturbed[0]
    found = result_of(run)["target"]["as_found"]
    rows = {name: (design, value) for name, design, value in page_of(run).table("the target", "by design")}
    leaning = [f"leaning of {one}" for one in ("P1", "P2", "P3")]
    assert list(rows) == ["b", "e", "angle between wall and P1", "angle between wall and P3", *leaning]
    assert rows["b"] == ("3.0000 m", f"{found['b_m']:.4f} m")
    assert rows["e"] == ("0.5000 m", f"{found['e_m']:.4f} m")
    assert rows["angle between wall and P3"] == ("45.0000 °", f"{found['corner_deg']['P3']:.4f} °")
    assert float(rows["leaning of P1"][1].split()[0]) == pytest.approx(found["lean_deg"]["P1"], abs=5.1e-5)


def test_the_total_sigma_is_the_sum_of_its_parts(undisturbed: tuple[Path, Told]) -> None:
    run = undisturbed[0]
    rows = page_of(run).table("", "roll, °", "pitch, °", "yaw, °", "x, mm", "y, mm", "z, mm")
    assert [row[0] for row in rows[:2]] == ["noise (the random sigma)", "the laser's angles"]
    parts = np.array([row[1:] for row in rows], dtype=float)
    total = np.array(result_of(run)["mbes"]["sigma_total"]["rotation_vector_deg"])
    arms = 1000 * np.array(result_of(run)["mbes"]["sigma_total"]["lever_arm_m"])
    expected = np.r_[total[[1, 0, 2]], arms]
    np.testing.assert_allclose(np.sqrt((parts**2).sum(axis=0)), expected, rtol=0.01, atol=0.0002)


@pytest.mark.usefixtures("unpainted")
def test_a_laser_whose_six_correlate_is_one_part_of_the_total(done: Place) -> None:
    """Given as a covariance: whole in the total sigma, one row on the page, and the parts add up as before."""
    sigma = np.repeat([np.radians(0.01), 0.002], 3)
    correlation = np.eye(6)
    correlation[2, 4] = correlation[4, 2] = 0.9
    done.edit_session("laser", mount_covariance=(correlation * np.outer(sigma, sigma)).tolist())
    told = done.calibrate("--report")
    assert told.status == 0, told.err
    rows = page_of(done.run).table("", "roll, °", "pitch, °", "yaw, °", "x, mm", "y, mm", "z, mm")
    assert [row[0] for row in rows[:3]] == ["noise (the random sigma)", "the laser's mount", "the laser's ranges"]
    parts = np.array([row[1:] for row in rows], dtype=float)
    block = result_of(done.run)["mbes"]["sigma_total"]
    expected = np.r_[np.array(block["rotation_vector_deg"])[[1, 0, 2]], 1000 * np.array(block["lever_arm_m"])]
    np.testing.assert_allclose(np.sqrt((parts**2).sum(axis=0)), expected, rtol=0.01, atol=0.0002)
    freed = pd.read_parquet(done.run / "adjust" / "freed.parquet").set_index("unknown")
    mine = [f"laser_{kind}_{axis}" for kind in ("rotation", "lever_arm") for axis in "xyz"]
    np.testing.assert_allclose(freed["considered"][mine], sigma, rtol=1e-6)
    effects = freed.loc[mine, [f"effect_{kind}_{axis}" for kind in ("rotation", "lever_arm") for axis in "xyz"]]
    E = effects.to_numpy()
    whole = np.sqrt(np.diag(E.T @ correlation @ E))
    written = result_of(done.run)["systematic"]["laser_mount"]
    np.testing.assert_allclose(np.array(list(written["effects"].values())), E, rtol=1e-12)
    np.testing.assert_allclose(written["correlation"], correlation, atol=1e-12)
    shown = parts[1] * np.r_[np.full(3, np.pi / 180), np.full(3, 1e-3)]
    np.testing.assert_allclose(shown, whole[[1, 0, 2, 3, 4, 5]], rtol=0.03, atol=2e-6)


def test_complete_in_itself_and_not_large(undisturbed: tuple[Path, Told]) -> None:
    run = undisturbed[0]
    page = page_of(run)
    assert_self_contained(page)
    assert (run / "report" / "report.html").stat().st_size < 5_000_000
    pictures = page.named("img")
    assert len(pictures) == 8
    for picture in pictures:
        assert picture["alt"]
        svg = base64.b64decode(str(picture["src"]).partition(",")[2]).decode("utf-8")
        assert "<script" not in svg
        assert not re.search(r'href="(?!#|data:image/png)', svg)


def test_names_stay_names(done: Place) -> None:
    done.edit_session("", name=HOSTILE[:300])
    hostile = done.session / "laser" / "<img src=x onerror=alert(1)> & '水池'.las"
    done.raw("laser").rename(hostile)
    done.edit_config("", result="patent_alternating")
    assert done.calibrate("--report", "--overwrite").status in (0, 1)
    page = page_of(done.run)
    assert_self_contained(page)
    assert page.headings[0] == HOSTILE[:300]
    assert f"laser/{hostile.name}" in [row[1] for row in page.table("sensor", "file")]
    assert f"laser/{hostile.name}" in [row[0] for row in page.table("raw file")]
    assert {"img", "script"} & {tag for tag, _ in page.tags} == {"img"}
    assert all(attributes.keys() == {"class", "alt", "src"} for attributes in page.named("img"))


def test_a_rejected_session_says_why_and_what_is_not_there(done: Place) -> None:
    """One pass alone, and limits that nothing keeps."""
    done.edit_config("verdict", max_sigma_deg=1e-6)
    told = done.calibrate("--report")
    assert told.status == 1
    page, result = page_of(done.run), result_of(done.run)
    assert page.text.index("rejected") < page.text.index("coarse")
    for reason in result["reasons"]:
        assert reason in page.text
    assert "must not be used" in page.text


def test_drawn_again_only_with_cause(done: Place) -> None:
    assert done.calibrate("--report").status == 0
    path = done.run / "report" / "report.html"
    before = path.read_bytes()
    written = path.stat().st_mtime_ns
    assert done.calibrate("--report").status == 0
    assert path.stat().st_mtime_ns == written
    path.unlink()
    assert draw_missing(done.run, Drawings(report=True, recordings=False)) == []
    assert path.read_bytes() == before  # the same run, the same page
    done.edit_config("ingest", max_gap_s=4.9)  # changes no pass here, and no input of the report
    assert done.calibrate("--report").status == 0
    changed = {row[1]: row[2] for row in page_of(done.run).table("from", "key", "value")}
    assert changed["ingest.max_gap_s"] == "4.9"
    assert poolcal("verify", done.run).status == 0


@pytest.mark.thorough
def test_stages_that_do_not_agree_are_not_drawn_together(done: Place) -> None:
    assert done.calibrate("--report").status == 0
    path = done.run / "report" / "report.html"
    before = path.read_bytes()
    done.edit_config("segment", margin_m=0.06)
    words = ("--session", done.session, "--config", done.config)
    assert poolcal("stage", "segment", done.run, *words, "--report").status == 0
    assert path.read_bytes() == before
    for name in ORDER[ORDER.index("segment") + 1 :]:
        assert poolcal("stage", name, done.run, "--report").status == 0
    assert path.read_bytes() != before


def test_settings_that_were_not_used_are_not_shown(done: Place) -> None:
    """run.yaml may be newer than the results: then nothing is drawn, and nothing is compared."""
    done.edit_session("mbes", mount={"roll_deg": -20.0})
    words = ("--session", done.session, "--config", done.config, "--report", "--recordings")
    assert poolcal("stage", "ingest", done.run, *words).status == 0
    assert not (done.run / "report" / "report.html").exists()
    assert [path.stem for path in done.run.glob("*/*.rrd")] == ["ingest"]
    told = poolcal("diff", done.run, done.run)
    assert (told.status, len(told.err.splitlines())) == (2, 1)
    assert "was made from other settings or results" in told.err


@pytest.mark.usefixtures("unpainted")
def test_what_lies_in_the_pages_place_is_no_matter(done: Place) -> None:
    path = done.run / "report" / "report.html"
    outside = done.folder / "outside.txt"
    outside.write_text("mine")
    for content in often((b"\xff\xfe",), (b"\xff\xfe", b"", "·".encode()[:1])):
        path.write_bytes(content)
        path.with_name("report.html.new").symlink_to(outside)
        told = done.calibrate("--report")
        assert (told.status, told.complaints) == (0, [])
        assert "accepted" in page_of(done.run).text
        assert outside.read_text() == "mine"
        assert not path.is_symlink()


@pytest.mark.usefixtures("unpainted")
def test_a_page_that_cannot_be_drawn_spoils_nothing(
    done: Place, right: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import pipeline.results.pages.report

    def fails(*_: object) -> str:
        raise ValueError("no ink")

    monkeypatch.setattr(pipeline.results.pages.report, "report_page", fails)
    told = done.calibrate("--report")
    assert told.status == 0
    assert told.complaints[-1] == "report.html: not drawn (ValueError: no ink); the calibration is complete"
    assert "Traceback" in told.err
    assert digests(done.run) == right
    assert not (done.run / "report" / "report.html").exists()
    assert "report.html" not in told.out
    monkeypatch.undo()
    assert f"Report: {done.run / 'report' / 'report.html'}" in done.calibrate("--report").out


def test_compared_as_a_page(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    run = tmp_path / "<b>run</b>"
    shutil.copytree(undisturbed[0], run)
    out = tmp_path / "diff.html"
    told = poolcal("diff", undisturbed[0], run, "--html", out)
    assert told.status == 0
    page = Page(out.read_text(encoding="utf-8"))
    assert_self_contained(page)
    assert "The same result in both." in page.text
    assert str(run) in [row[3] for row in page.table("", "session")]
    assert not page.named("b")
    kept = digests(run)
    for place, words in (
        (tmp_path / "no" / "such" / "folder.html", "there is no folder"),
        (run / "report" / "page.html", "lies in the folder"),
        (run / "report" / "calibration.json", "ends in .html"),
        ("/dev/null", "ends in .html"),
        (tmp_path, "ends in .html"),
    ):
        told = poolcal("diff", undisturbed[0], run, "--html", place)
        assert (told.status, len(told.err.splitlines())) == (2, 1)
        assert words in told.err
    assert digests(run) == kept
