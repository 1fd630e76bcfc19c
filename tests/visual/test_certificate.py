"""The certificate on paper: two sheets, with a line to sign; and a mark on every sheet of a rejected run."""

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image

from tests.support.places import Place, poolcal

FULL: dict[str, Any] = {
    "report_number": "2026-017", "project": "Harbour basin resurvey, lot 2", "client": "Port Authority of Example",
    "vessel": "海测 7, survey launch, 9.8 m", "bracket": "over-the-side pole, starboard, hinge locked with two pins",
    "place": "test pool of the shipyard, east end", "surveyor": "Wang Li, J. O'Brien", "approved_by": "A. Example",
    "weather": "overcast, wind 2 m/s", "water_temperature": "17.4 °C at 1 m", "datum": "CGCS2000", "epoch": "2026.36",
    "ins_reference_point": "centre of the IMU's housing", "laser_calibration": "certificate C-2201 of 2026-02-03",
    "target_survey": "total station, 2026-04-28, sheet 3", "sound_speed": "cast at 07:50 UTC",
    "remarks": "trial before the harbour survey; the second pass was sailed twice because of a passing tug",
    "instruments": {
        sensor: {"make": "Example", "model": "One 2000", "serial": "NMND21340012L", "firmware": "OM7MR0810"}
        for sensor in ("ins", "laser", "mbes", "sound_speed_probe")
    },
}  # fmt: skip


@pytest.fixture(params=["browser", "library"])
def program(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """What writes the PDF."""
    if request.param == "browser":
        monkeypatch.setitem(sys.modules, "weasyprint", None)
        return "chrom"
    pytest.importorskip("weasyprint")
    return "WeasyPrint"


@pytest.fixture
def place(run: Path, small: Path, tmp_path: Path) -> Place:
    made = Place(small, tmp_path)
    made.mend()
    shutil.copytree(run, made.run)
    made.edit_session("", about=FULL)
    return made


def printed(place: Place, program: str, *more: str) -> Path:
    """The run's PDF; ``more``: further options."""
    pdf = place.folder / "水池 report.pdf"
    told = poolcal("report", place.run, "--pdf", pdf, *more)
    assert (told.status, told.err) == (0, "")
    assert program in told.out
    return pdf


def sheets_of(pdf: Path) -> list[str]:
    """The text of each sheet, blanks taken out."""
    text = subprocess.run(["pdftotext", "-layout", pdf, "-"], capture_output=True, text=True, check=True).stdout
    return ["".join(sheet.split()) for sheet in text.split("\f")[:-1]]


def marks_on(pdf: Path) -> list[int]:
    """On each sheet, the dots of the mark's pale red, of which 40 make an inch."""
    subprocess.run(["pdftoppm", "-r", "40", "-png", pdf, pdf.with_name("sheet")], check=True)
    dots = []
    for path in sorted(pdf.parent.glob("sheet-*.png")):
        red, green, blue = np.moveaxis(np.asarray(Image.open(path).convert("RGB")).astype(int), 2, 0)
        dots.append(int(np.sum((red > 200) & (red - green > 30) & (abs(red - green - (red - blue)) < 16))))
        path.unlink()
    return dots


def test_a_certificate_is_two_sheets(place: Place, program: str) -> None:
    assert place.calibrate("--no-report").status == 0
    pdf = printed(place, program)
    sheets = sheets_of(pdf)
    for words in ("CALIBRATIONCERTIFICATE", "海测7", "NMND21340012L", "Mountofthesonar", "starboarddown", "Dashed:"):
        assert words in sheets[0]
    for words in ("Whatlimitseachvalue", "ExclusiveOrder", "SHA-256", "signature", "approvedby", "A.Example"):
        assert words in sheets[1]
    assert "Thesonar'smount" in sheets[2]
    for number, sheet in enumerate(sheets, 1):
        assert f"{number}/{len(sheets)}" in sheet
    assert marks_on(pdf)[:2] == [0, 0]
    name = "".join(yaml.safe_load((place.run / "run.yaml").read_text(encoding="utf-8"))["session"]["name"].split())
    assert [sheet.count(name) for sheet in sheets[:2]] == [1, 1]  # large on the first, in the margin of the next
    alone = [sheet.replace(f"{number}/{len(sheets)}", f"{number}/2") for number, sheet in enumerate(sheets[:2], 1)]
    assert sheets_of(printed(place, program, "--certificate")) == alone


@pytest.mark.thorough
def test_a_rejected_run_is_marked_on_every_sheet(place: Place, program: str) -> None:
    place.edit_config("verdict", max_sigma_deg=1e-6)
    assert place.calibrate("--no-report").status == 1
    pdf = printed(place, program)
    sheets, marks = sheets_of(pdf), marks_on(pdf)
    assert len(sheets) == len(marks) > 5
    assert min(marks) > 100
    assert not any("signature" in sheet for sheet in sheets)
    alone = printed(place, program, "--certificate")
    assert len(sheets_of(alone)) == len(marks_on(alone)) == 2
    assert min(marks_on(alone)) > 100
