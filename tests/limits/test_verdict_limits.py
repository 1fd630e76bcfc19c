"""Limits by purpose: the pool's, those of an order of survey, stated numbers before them, and the laser's."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from pipeline.config.verdict import VerdictLimits
from pipeline.limits.verdict_limits import (
    largest_sigmas,
    limits_by_setting,
    limits_document,
    limits_of,
    purpose_in_words,
    soundings_too_uncertain,
)

POOL = {"roll_deg": 0.05, "pitch_deg": 0.05, "yaw_deg": 0.05, "x_m": 0.005, "y_m": 0.005, "z_m": 0.005}
PURPOSES = ("construction", "exclusive_order", "special_order", "order_1a", "order_1b", "order_2")


def test_the_pool_is_the_default_and_judges_no_soundings() -> None:
    assert limits_by_setting(VerdictLimits()) == POOL
    assert purpose_in_words(VerdictLimits()) == ""
    assert soundings_too_uncertain(VerdictLimits(), np.eye(6)) == ""


def test_a_laxer_order_never_has_smaller_limits() -> None:
    limits = [largest_sigmas(VerdictLimits(purpose=purpose)) for purpose in PURPOSES]
    for stricter, laxer in pairwise(limits):
        assert (stricter <= laxer).all()
    assert np.degrees(limits[2][1]) == pytest.approx(0.0738, abs=1e-4)  # 0.3 · 0.2915 m / (1.96 · 20 m · tan 60°)


def test_no_survey_makes_a_calibration_of_what_a_tape_gives() -> None:
    lax = limits_by_setting(VerdictLimits(purpose="order_2", depth_m=1.0, mount_share=1.0))
    assert set(lax.values()) == {0.25, 0.025}


def test_deeper_water_wants_better_angles_and_a_wider_swath_wants_better_roll() -> None:
    near, deep, wide = (
        limits_by_setting(VerdictLimits(purpose="special_order", depth_m=depth, swath_deg=swath))
        for depth, swath in ((20, 60), (40, 60), (20, 75))
    )
    assert deep["roll_deg"] < near["roll_deg"]
    assert wide["roll_deg"] == pytest.approx(near["roll_deg"] * np.tan(np.radians(60)) / np.tan(np.radians(75)))
    assert near["z_m"] == deep["z_m"] == wide["z_m"] == 0.025


def test_stated_numbers_go_before() -> None:
    assert limits_by_setting(VerdictLimits(max_sigma_deg=0.07)) == POOL | dict.fromkeys(
        ("roll_deg", "pitch_deg", "yaw_deg"), 0.07
    )
    mixed = VerdictLimits(purpose="special_order", max_sigma_m=0.004)
    assert limits_by_setting(mixed)["z_m"] == 0.004
    assert limits_by_setting(mixed)["roll_deg"] == limits_by_setting(VerdictLimits(purpose="special_order"))["roll_deg"]
    assert soundings_too_uncertain(mixed, 1e-4 * np.eye(6))  # soundings are judged all the same


def test_each_within_its_limit_is_not_enough_if_all_together_are_beyond() -> None:
    verdict = VerdictLimits(purpose="construction")
    limits = largest_sigmas(verdict)
    alone = np.zeros((6, 6))
    alone[1, 1] = limits[1] ** 2
    assert soundings_too_uncertain(verdict, 0.9999 * alone) == ""
    assert "in height, at a depth of 20 m" in soundings_too_uncertain(verdict, 1.0002 * alone)
    assert soundings_too_uncertain(verdict, 0.95 * np.diag(limits**2))
    assert soundings_too_uncertain(verdict, 0.40 * np.diag(limits**2)) == ""


def test_a_laser_has_the_stated_numbers_or_the_pools() -> None:
    verdict = VerdictLimits(purpose="order_2", max_sigma_m=0.007)
    assert limits_of(verdict, "mbes") is verdict
    of_laser = limits_of(verdict, "laser")
    assert limits_by_setting(of_laser) == POOL | {"x_m": 0.007, "y_m": 0.007, "z_m": 0.007}
    assert purpose_in_words(of_laser) == ""


def test_the_document_says_what_it_is_good_for() -> None:
    written = limits_document(VerdictLimits(purpose="order_1a", depth_m=35.5, swath_deg=50))
    assert written["in_words"] == "Order 1a (IHO S-44) down to 35.5 m, beams to 50°"
    assert (written["depth_m"], written["swath_deg"], written["mount_share"]) == (35.5, 50.0, 0.3)
    assert written["max_sigma_deg"] == max(written["each"][key] for key in ("roll_deg", "pitch_deg", "yaw_deg"))
    assert written["max_sigma_m"] == max(written["each"][key] for key in ("x_m", "y_m", "z_m"))
    pool = limits_document(VerdictLimits())
    assert pool == {"max_sigma_deg": 0.05, "max_sigma_m": 0.005, "purpose": "pool", "in_words": "", "each": POOL}


def test_the_documents_table_has_these_limits() -> None:
    text = (Path(__file__).parents[2] / "docs" / "read-the-report.md").read_text(encoding="utf-8")
    first = re.compile(r"\| `(pool|construction|\w+order|order_\w+)`")
    rows = [line.split("|") for line in text.splitlines() if first.match(line)]
    told = {purpose: row[-2].strip() for row in rows for purpose in re.findall(r"`(\w+)`", row[1])}
    for purpose in ("pool", *PURPOSES):
        limits = limits_by_setting(VerdictLimits(purpose=purpose))
        digits = 2 if purpose == "pool" else 3
        angles = ", ".join(f"{limits[key]:.{digits}f}°" for key in ("roll_deg", "pitch_deg", "yaw_deg"))
        assert told.pop(purpose) == f"{angles}; {1000 * limits['z_m']:.0f} mm"
    assert not told
