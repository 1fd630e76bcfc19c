"""The report, the comparison and the history in headless Chromium: on a telephone, on a desk, on paper."""

import json
import re
import shutil
import subprocess
from collections import Counter
from html import unescape
from pathlib import Path
from typing import Any

import pytest

from pipeline.results.pages.rendering import SMALLEST_PT, WIDTH_IN
from tests.support.pages import Page
from tests.support.places import poolcal
from tools.pictures import chromium

WIDTHS = (390, 1280)
LEGIBLE_PX = 9
A4_PT = 210 / 25.4 * 72  # its width
PRINT_IN = (210 - 2 * 14) / 25.4  # its width within the margins
MEASURE = """<!doctype html><meta charset="utf-8"><pre id="out"></pre>
<iframe id="page" src="PAGE" style="width: 1280px; height: 900px; border: 0"></iframe>
<script>
document.getElementById("page").onload = () => {
  const frame = document.getElementById("page"), page = frame.contentDocument, found = {};
  for (const width of [390, 1280]) {
    frame.style.width = width + "px";
    const right = (tag) => [...page.querySelectorAll(tag)].map((one) => one.getBoundingClientRect().right);
    const boxes = [...page.images].map((one) => (one.closest(".wide") || one).getBoundingClientRect().right);
    const scale = [...page.images].map((one) => one.getBoundingClientRect().width / one.naturalWidth);
    const shown = [...page.querySelectorAll(".phone")].map((one) => one.getBoundingClientRect().height > 0);
    found[width] = { scroll: page.documentElement.scrollWidth, tables: right("table"), pictures: boxes, scale, shown };
  }
  found.drawn = [...page.images].map((one) => one.complete && one.naturalWidth > 0);
  document.getElementById("out").textContent = JSON.stringify(found);
};
</script>"""


@pytest.fixture(scope="module", params=["report", "comparison", "history"])
def page(request: pytest.FixtureRequest, run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Each page with its own names, the longest among them."""
    folder = tmp_path_factory.mktemp("pages")
    if request.param == "report":
        return Path(shutil.copy(run / "report" / "report.html", folder / "page.html"))
    if request.param == "comparison":
        poolcal("diff", run, run, "--html", folder / "page.html")
        return folder / "page.html"
    runs = folder / "runs"
    for name in ("one", "two"):
        shutil.copytree(run, runs / name)
    path = runs / "two" / "report" / "calibration.json"
    result = json.loads(path.read_text(encoding="utf-8")) | {"session": "池" * 100 + "x" * 200, "verdict": "rejected"}
    path.write_text(json.dumps(result), encoding="utf-8")
    assert poolcal("history", runs, "--out", folder).status == 0
    return (folder / "history.html").rename(folder / "page.html")


def measured(page: Path) -> dict[str, Any]:
    harness = page.with_name("measure.html")
    harness.write_text(MEASURE.replace("PAGE", page.name), encoding="utf-8")
    options = ("--allow-file-access-from-files", "--virtual-time-budget=10000", "--dump-dom")
    dom = chromium(*options, harness.as_uri()).stdout
    found: dict[str, Any] = json.loads(unescape(re.search(r'<pre id="out">(.*?)</pre>', dom, re.DOTALL)[1]))
    return found


def test_everything_is_inside_the_page_and_drawn(page: Path) -> None:
    found = measured(page)
    pictures, tables = (Page(page.read_text(encoding="utf-8")).named(tag) for tag in ("img", "table"))
    assert found["drawn"] == [True] * len(pictures)
    for width in WIDTHS:
        seen = found[str(width)]
        assert len(seen["tables"]) == len(tables)
        assert len(seen["pictures"]) == len(pictures)
        assert max([seen["scroll"], *seen["tables"], *seen["pictures"]]) <= width, width
        assert set(seen["shown"]) == {width < 600}  # what is left out here, and where to find it
        assert min(seen["scale"]) * SMALLEST_PT * 96 / 72 >= LEGIBLE_PX, width


def test_a_table_too_wide_would_be_seen(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    page.write_text("<table><tr><td style='min-width: 900px'>wide</td></tr></table><img src='no.png'>")
    found = measured(page)
    assert max(found["390"]["tables"]) > 390
    assert max(found["1280"]["tables"]) <= 1280
    assert found["drawn"] == [False]


def test_the_console_stays_empty(page: Path, tmp_path: Path) -> None:
    assert "CONSOLE" not in chromium("--dump-dom", page.as_uri()).stderr
    loud = tmp_path / "loud.html"
    loud.write_text("<script>console.log('heard')</script>")
    assert "CONSOLE" in chromium("--dump-dom", loud.as_uri()).stderr  # a message would be heard


def test_on_paper_nothing_is_cut(page: Path, tmp_path: Path) -> None:
    """Every word of every cell is on a sheet, within its margins, and each row on one sheet."""
    pdf = tmp_path / "page.pdf"
    chromium("--no-pdf-header-footer", f"--print-to-pdf={pdf}", page.as_uri())
    boxes = subprocess.run(["pdftotext", "-bbox", pdf, "-"], capture_output=True, text=True, check=True).stdout
    sheets: list[str] = []
    title = unescape(re.search("<title>(.*?)</title>", page.read_text(encoding="utf-8"), re.DOTALL)[1])
    for sheet in re.split(r"<page ", boxes)[1:]:
        width, height = (float(one) for one in re.search(r'width="(.*?)" height="(.*?)"', sheet).groups())
        assert (width, height) == (pytest.approx(595, abs=2), pytest.approx(842, abs=2))  # A4
        words = re.findall(r'<word xMin="(.*?)" yMin="(.*?)" xMax="(.*?)" yMax="(.*?)">(.*?)</word>', sheet)
        for left, top, right, bottom, word in words:
            assert float(left) > 20, word
            assert float(right) < width - 20, word
            assert float(top) > 20, word
            assert float(bottom) < height - 20, word
        sheets.append("".join(unescape(word) for *_, word in words))
        head = "".join(title.split())[:20]
        in_large = re.sub(r"\W", "", head) in re.sub(r"\W", "", sheets[-1][:60])  # the first sheet's own words
        assert sheets[-1].startswith(head) or in_large  # which session, and the verdict, on each sheet
    for number, sheet in enumerate(sheets, 1):
        assert f"{number}/{len(sheets)}" in sheet
    whole = "".join(sheets)
    taken = Page(page.read_text(encoding="utf-8"))
    named = [attributes.get("class") or "" for attributes in taken.named("table")]
    for table, classes in zip(taken.tables, named, strict=True):
        if "whole" in classes.split():
            short = ["".join(cell.split()) for row in table for cell in row if len(cell) < 12]
            assert any(all(cell in sheet for cell in short) for sheet in sheets), short  # never torn
        for row in table:
            for cell in row:
                letters = "".join(cell.split())  # of a long one, broken into lines, the order is lost
                pieces = re.split(r"\s+|(?<=[_-])", cell)  # a line may end after _ and -
                lines = len(cell) < 40 and all(piece in whole for piece in pieces)
                assert letters in whole or lines or (len(cell) >= 40 and not Counter(letters) - Counter(whole)), cell
            short = [word for cell in row if len(cell) < 40 for word in re.split(r"\s+|(?<=[_-])", cell)]
            assert any(all(cell in sheet for cell in short) for sheet in sheets), row


def test_on_paper_no_letter_is_small(page: Path, tmp_path: Path) -> None:
    """The browser shrinks a sheet on which something is too wide; the sizes are those after that."""
    pdf = tmp_path / "page.pdf"
    chromium("--no-pdf-header-footer", f"--print-to-pdf={pdf}", page.as_uri())
    command = ["pdftohtml", "-xml", "-i", "-stdout", "-zoom", "3", pdf]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    across = float(re.findall(r'<page [^>]* width="(\d+)"', text)[0])
    sizes = [float(size) / across * A4_PT for size in re.findall(r'<fontspec id="\d+" size="(\d+)"', text)]
    assert min(sizes) >= SMALLEST_PT - 0.2, sizes  # they are told to a third of a point
    assert SMALLEST_PT * PRINT_IN / WIDTH_IN >= SMALLEST_PT - 0.1  # of letters in pictures


def test_ink_on_the_report(run: Path, tmp_path: Path) -> None:
    """Looked at as a picture: neither empty nor of one colour, from the top to the bottom."""
    from PIL import Image

    picture = tmp_path / "report.png"
    chromium("--window-size=1280,6000", f"--screenshot={picture}", (run / "report" / "report.html").as_uri())
    image = Image.open(picture).convert("RGB")
    for top in range(0, 5000, 1000):
        colours = image.crop((0, top, 1280, top + 1000)).getcolors(1_000_000)
        assert colours is not None
        assert len(colours) > 30, top
        assert max(count for count, _ in colours) < 0.995 * 1280 * 1000, top
