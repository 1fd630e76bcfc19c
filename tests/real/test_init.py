"""What poolcal init makes of real files, which are of many sessions and makers."""

import shutil
from pathlib import Path

import yaml

from tests.support.places import poolcal
from tests.support.real_files import ATLANS, HE, PPP, XTF


def _session(data: Path, folder: Path, *names: str) -> str:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(data / name, folder / name)
    told = poolcal("init", folder)
    assert told.status == 0, told.err
    text = (folder / "session.yaml").read_text(encoding="utf-8")
    assert all(len(line) <= 120 for line in text.splitlines())
    return text


def test_one_file_of_each_sensor(data: Path, tmp_path: Path) -> None:
    text = _session(data, tmp_path, PPP, "laser/test1_4.las", XTF, "casts/caris/cidco_s20200713.svp")
    content = yaml.safe_load(text)
    assert {name: content[name]["format"] for name in ("ins", "mbes")} == {"ins": "novatel", "mbes": "r2sonic"}
    assert "instrument" not in content["mbes"]  # a Sonic 2026, of which there is no preset
    assert "R2Sonic 2026, for which there is no preset" in text
    assert "# svp: casts/caris/cidco_s20200713.svp" in text


def test_an_sbet_with_its_accuracy_file_and_no_date(data: Path, tmp_path: Path) -> None:
    accuracy = "ins/sbet_ATLANS-20181023-accuracy.out"
    content = yaml.safe_load(_session(data, tmp_path, ATLANS, accuracy, XTF))
    assert content["ins"] == {
        "files": [ATLANS], "format": "sbet", "gps_week": "FILL_IN", "accuracy": [accuracy],
    }  # fmt: skip


def test_what_cannot_be_read_is_listed_with_the_reason(data: Path, tmp_path: Path) -> None:
    names = ("ins/pdal_badfile.sbet", "laser/bunnyInt32.e57", "laser/riegl_130501_232206_cut.rxp", XTF, HE)
    text = _session(data, tmp_path, *names)
    left = " ".join(text.partition("# Files that are not used")[2].replace("\n#", " ").split())
    for words in ("the copy is not complete", "has no times of points", "is a RIEGL .rxp file"):
        assert words in left
    content = yaml.safe_load(text)
    assert content["mbes"]["format"] == "FILL_IN"  # two kinds of sonar files
    for kind in ("format: all", "format: r2sonic"):
        assert f"#   {kind}" in text
