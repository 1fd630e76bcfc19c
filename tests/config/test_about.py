"""The block about of session.yaml: free text, but text; and nothing of it is computed with."""

import datetime
import re
import textwrap
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
import yaml

from pipeline.config.about import LONGEST, About, AboutInstruments
from pipeline.config.load import load_session
from pipeline.errors import ConfigError
from stages import LASER, ORDER, load
from tests.support.roots import ROOT

MOUNT = {"roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0, "x_m": 0.0, "y_m": 0.0, "z_m": -1.0}
SESSION: dict[str, Any] = {
    "ins": {"files": ["ins/*"], "format": "novatel"},
    "laser": {"files": ["laser/*"], "format": "las", "mount": MOUNT.copy()},
    "mbes": {"files": ["mbes/*"], "format": "r2sonic", "mount": MOUNT.copy()},
}


def read(folder: Path, about: Any) -> About:
    text = yaml.safe_dump(SESSION | {"about": about}, allow_unicode=True)
    (folder / "session.yaml").write_text(text, encoding="utf-8")
    return load_session(folder).about


def test_all_of_it_may_be_left_out(tmp_path: Path) -> None:
    (tmp_path / "session.yaml").write_text(yaml.safe_dump(SESSION), encoding="utf-8")
    assert load_session(tmp_path).about == About()
    assert read(tmp_path, {}) == read(tmp_path, None) == About()  # null: a head whose keys are all comments


def test_words_stay_as_they_are_in_one_line(tmp_path: Path) -> None:
    about = read(
        tmp_path,
        {
            "vessel": "海测 7 <b>\"x\"</b> & sons",
            "remarks": "one\n two \n",
            "instruments": {"mbes": {"serial": "00123", "firmware": "1.10"}},
        },
    )
    assert about.vessel == "海测 7 <b>\"x\"</b> & sons"
    assert about.remarks == "one two"
    assert about.instruments.mbes.serial == "00123"
    assert about.client is None


def test_as_long_as_it_may_be(tmp_path: Path) -> None:
    assert read(tmp_path, {"place": "池" * LONGEST}).place == "池" * LONGEST
    with pytest.raises(ConfigError, match=f"about.place = '池+...: has more than {LONGEST} characters"):
        read(tmp_path, {"place": "池" * (LONGEST + 1)})


@pytest.mark.parametrize(
    ("about", "words"),
    [
        ({"vesel": "x"}, "about.vesel: unknown key; is it vessel? known here: "),
        ({"instruments": {"sonar": {}}}, "about.instruments.sonar: unknown key; "),
        ({"instruments": {"ins": {"serial": 21340012}}}, "about.instruments.ins.serial = 21340012: should be text"),
        ({"vessel": ["a", "b"]}, "about.vessel = ['a', 'b']: should be text"),
        ({"laser_calibration": datetime.date(2026, 2, 3)}, "about.laser_calibration = 2026-02-03: is a date; put"),
        ({"vessel": " \n"}, "is empty: leave the key out"),
        ({"client": "a\x07b"}, "holds the character U+0007, which cannot be printed"),
        ({"client": "a\u202eb"}, "holds the character U+202E"),
        ("Haida 7", "about = 'Haida 7': "),
    ],
)
def test_what_is_no_text_is_refused_in_one_line(tmp_path: Path, about: Any, words: str) -> None:
    with pytest.raises(ConfigError) as error:
        read(tmp_path, about)
    (line,) = str(error.value).splitlines()
    assert line.startswith(f"{tmp_path / 'session.yaml'}: about")
    assert words in line


def test_the_document_shows_every_key(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "certificate.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^    about:\n(?:      .*\n)+", page, re.MULTILINE)
    shown = yaml.safe_load(textwrap.dedent(block))["about"]
    assert set(shown) == set(About.model_fields)
    assert set(shown["instruments"]) == set(AboutInstruments.model_fields)
    assert read(tmp_path, shown).vessel == shown["vessel"]


def test_no_stage_has_it_in_its_settings() -> None:
    modules = {module.__name__: module for module in (*load("mbes"), *load("laser"))}
    assert len(modules) == len({*ORDER, *LASER})
    for module in modules.values():
        assert "about" not in {field.name for field in fields(module.Config)}
