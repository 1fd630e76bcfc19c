"""The report's words on the patent's form, on the drift, and on the faces: they follow from the numbers."""

import numpy as np
import pandas as pd
import pytest

from pipeline.config.target import Letters, Origin
from pipeline.language import chosen
from pipeline.maths.target.face import Face
from pipeline.maths.target.family_words import families_in_words
from pipeline.maths.target.model import Family, TargetModel
from pipeline.maths.target.outlines import Outline, build_target
from pipeline.results.pages.drift_words import drift_rows, drift_sentence
from pipeline.results.pages.patent_check import patent_check
from pipeline.target.design import target_of
from pipeline.text_table import SCREEN, wrapped
from tests.support.evidence import drift_figures

KEYS = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m")
SIGMAS = dict(zip(KEYS, (0.02, 0.02, 0.01, 0.004, 0.002, 0.004), strict=True))


def _methods(**off: float) -> dict[str, dict[str, object]]:
    adjusted = dict.fromkeys(KEYS, 0.0)
    return {
        "adjustment": {"mount": adjusted, "sigma_mount_total": SIGMAS},
        "patent_alternating": {"mount": adjusted | off},
    }


# --- the patent's form -----------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("off", "said", "holds"),
    [
        ({"roll_deg": 0.078}, "off by 3.9 total sigmas at most (roll +0.078 °)", True),
        ({"roll_deg": 0.082}, "off by 4.1 total sigmas at most (roll +0.082 °), more than 4", False),
        ({"x_m": -0.017}, "off by 4.2 total sigmas at most (x -17.0 mm)", False),
        ({"yaw_deg": 0.2, "y_m": 0.025, "z_m": 0.0186}, "off by 0.0 total sigmas", True),  # of these it tells little
    ],
)
def test_the_patent_s_check_is_off_beyond_four_sigmas(off: dict[str, float], said: str, holds: bool) -> None:
    words = patent_check(_methods(**off))
    assert said in words
    assert ("the check holds" in words, "does not hold" in words) == (holds, not holds)


def test_a_turn_through_180_degrees_is_no_difference() -> None:
    methods = _methods(roll_deg=-179.99)
    methods["adjustment"]["mount"] = dict.fromkeys(KEYS, 0.0) | {"roll_deg": 179.99}
    assert "roll +0.020 °): the check holds" in patent_check(methods)


def test_without_a_form_there_is_no_check() -> None:
    methods = _methods()
    assert patent_check({"adjustment": methods["adjustment"]}) == ""
    assert patent_check(methods | {"patent_alternating": {"mount": None}}) == ""


# --- the drift -------------------------------------------------------------------------------------------------------
def _figures(**changes: tuple[float, float]) -> pd.DataFrame:
    return drift_figures(**changes).assign(sigma_log=0.5)


def test_a_smaller_and_slower_drift_is_all_right() -> None:
    figures = _figures(horizontal_m=(0.0015, -3.0), time_constant_s=(5650.0, 3.0))
    words = drift_sentence(figures, ["geometry_gap"])
    assert "its errors of position are 0.10 times as large" in words
    assert "its errors of attitude are about as large" in words
    assert "and the time over which they change is 28 times as long" in words
    assert "That is all right" in words
    assert [row["unit"] for row in drift_rows(figures)] == ["m", "m", "°", "°", "s"]


@pytest.mark.parametrize("code", ["ins_drift_above_settings", "ins_drift_off_figures", "ins_drift_between_passes"])
def test_the_sentence_says_what_the_verdict_says(code: str) -> None:
    """A drift three times as far: within the factors of the figures, and yet a warning or a reason."""
    words = drift_sentence(_figures(horizontal_m=(0.04, 1.4)), [code])
    assert "see the reasons and warnings" in words
    assert "all right" not in words


@pytest.mark.parametrize(
    ("change", "more"),
    [
        ({"horizontal_m": (0.0185, 0.3)}, False),
        ({"horizontal_m": (0.019, 0.4)}, True),
        ({"roll_pitch_deg": (0.02, 1.0)}, True),
        ({"time_constant_s": (170.0, -0.1)}, False),
        ({"time_constant_s": (150.0, -0.3)}, True),
        ({"time_constant_s": (900.0, 1.4)}, False),
    ],
)
def test_a_somewhat_larger_or_faster_drift_is_told_as_such(change: dict[str, tuple[float, float]], more: bool) -> None:
    words = drift_sentence(_figures(**change), [])
    assert ("more, or faster, than they say" in words, "all right" in words) == (more, not more)


def test_a_figure_of_zero_leaves_the_sentence_whole() -> None:
    figures = _figures(vertical_m=(0.01, -1.0))
    figures.loc[figures["figure"] == "horizontal_m", ["configured", "estimated"]] = 0.0
    assert "figures, its errors of position are 0.50 times as large, its" in drift_sentence(figures, [])
    figures.loc[figures["figure"] == "vertical_m", ["configured", "estimated"]] = 0.0
    assert "figures, its errors of attitude are about" in drift_sentence(figures, [])


def test_the_sentence_has_its_order_in_chinese_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POOLCAL_LANG", "zh")
    words = chosen.translated(drift_sentence(_figures(horizontal_m=(0.0015, -3.0)), []))
    assert words.startswith("与设置的数值相比，其位置误差为 0.10 倍，其姿态误差大小相当，其变化所经历的时间相当。")


def test_an_exact_drift_says_nothing() -> None:
    assert drift_sentence(drift_figures().assign(sigma_log=0.0), []) == ""


# --- the faces -------------------------------------------------------------------------------------------------------
def test_the_patent_s_target_is_told_as_the_boat_sees_it() -> None:
    origin = Origin(latitude_deg=36.0, longitude_deg=120.0, height_m=0.0)
    model = target_of(Letters(a=8.0, b=3.0, c=1.0, e=0.5, origin=origin, azimuth_deg=163.0))
    words = families_in_words(model)
    assert "P1: 8 faces turned 45° astern (-y); P2: 1 face straight towards the boat; P3: 8 faces turned 45° ahead" in (
        words
    )
    assert words.endswith("faces, horizontal (tops and bottoms)")
    north = [face for face in model.faces if face.family == "P3"]  # an own look at the sign: P3 stands at y > 0
    assert all(isinstance(face, Face) and np.min(np.asarray(face.vertices_m)[:, 1]) > 0 for face in north)


def test_a_face_that_leans_is_told_to() -> None:
    """A slipway rises away from the boat, and looks up at it; an overhang looks down."""
    slip = Family("slip", np.array([-0.8, 0.0, 0.6]), 0.0, (0,), True)
    overhang = Family("overhang", np.array([-0.5, -0.5, -np.sqrt(0.5)]), 0.0, (1, 2), True)
    words = families_in_words(TargetModel((), (slip, overhang), (), 0.0, None))
    assert "slip: 1 face straight towards the boat, looking up by 37°; " in words
    assert words.endswith("overhang: 2 faces turned 45° astern (-y), looking down by 45°")


def test_a_face_across_the_boat_is_told_to_be() -> None:
    """The walls of a lock: one looks back at the boat, one in its corner looks back and ahead, toward +y."""
    wall = Family("left", np.array([1.0, 0.0, 0.0]), 0.0, (0,), True)
    corner = Family("corner", np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0]), 0.0, (1,), True)
    words = families_in_words(TargetModel((), (wall, corner), (), 0.0, None))
    assert "left: 1 face across the boat, straight towards it; " in words
    assert words.endswith("corner: 1 face across the boat, turned 45° ahead (+y)")


@pytest.mark.parametrize(("pieces", "told"), [(3, "bottom-3: 1 face, horizontal"), (4, "; 4 more that the sonar")])
def test_many_pieces_of_the_bottom_are_only_counted(pieces: int, told: str) -> None:
    wall = Outline("wall", [(0, 2, -3), (0, -2, -3), (0, -2, 2), (0, 2, 2)])
    squares = [
        Outline(f"bottom-{k}", [(-3, k, -4), (-2, k, -4), (-2, k + 0.9, -4), (-3, k + 0.9, -4)], seen="wet")
        for k in range(1, pieces + 1)
    ]
    words = families_in_words(build_target([wall, *squares], [], 0.0, None))
    assert told in words
    assert ("bottom-1" in words) == (pieces < 4)


# --- the screen ------------------------------------------------------------------------------------------------------
def test_sentences_keep_within_the_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    words = " ".join(f"word{number}" for number in range(60)) + " " + "x" * 130 + " end"
    lines = wrapped(words, "  ", "    ")
    assert " ".join(" ".join(lines).split()) == words
    assert [line for line in lines if len(line) > SCREEN] == ["    " + "x" * 130]
    assert lines[0].startswith("  word0")
    chinese = "没有任何安装参数能使其点落在标靶上，" * 12
    lines = wrapped(chinese, following="")
    assert "".join(lines) == chinese
    assert max(sum(1 + (ord(letter) > 0x2E80) for letter in line) for line in lines) <= SCREEN + 2
    assert not any(line.startswith("，") for line in lines)
    assert chosen.language() == chosen.ENGLISH
