"""The statistics of campaigns, by rows whose errors are known."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tools.campaign_statistics import HEAD, markdown_row, nse_band, statistics_of
from tools.campaigns import path_of
from tools.laser_pairs import agreement, report
from tools.montecarlo import session_report
from tools.session_rows import NAMES, UNITS, error_columns
from tools.stress import table_of
from tools.stress_campaigns import STRESS

SIGMAS = np.array([0.005, 0.002, 0.008, 0.3, 0.9, 0.5])  # degrees, mm


def rows(z: np.ndarray, prefix: str = "") -> pd.DataFrame:
    """Sessions, all accepted, with errors of (n, 6) random sigmas; the total sigmas are twice as large."""
    table = {f"{prefix}nse": (z**2).sum(axis=1), f"{prefix}nse_total": (z**2).sum(axis=1) / 4}
    for k, name in enumerate(NAMES):
        table |= {f"{prefix}error_{name}": z[:, k] * SIGMAS[k], f"{prefix}sigma_{name}": np.full(len(z), SIGMAS[k])}
        table[f"{prefix}total_{name}"] = np.full(len(z), 2 * SIGMAS[k])
    return pd.DataFrame({"accepted": True} | table)


def drawn(size: float, count: int = 100) -> np.ndarray:
    """Errors (n, 6) with a mean square of exactly size²."""
    z = np.random.default_rng(3).normal(size=(count, 6))
    return np.asarray(size * z / np.sqrt(np.mean(z**2)))


def test_the_band_is_that_of_chi_squared() -> None:
    """For 600 degrees of freedom the normal approximation of Wilson and Hilferty holds to a thousandth."""
    low, high = nse_band(100)
    for value, quantile in ((low, -2.5758), (high, 2.5758)):
        assert value == pytest.approx(6 * (1 - 2 / 5400 + quantile * np.sqrt(2 / 5400)) ** 3, rel=1e-3)
    assert nse_band(600) == pytest.approx((5.64, 6.37), abs=0.005)


@pytest.mark.parametrize(("nse", "inside"), [(5.10, False), (5.20, True), (6.0, True), (6.90, True), (7.00, False)])
def test_both_sides_of_the_band(nse: float, inside: bool) -> None:
    statistics = statistics_of(rows(drawn(np.sqrt(nse / 6))))
    assert statistics.nse == pytest.approx(nse)
    assert statistics.nse_total == pytest.approx(nse / 4)
    assert statistics.in_band is inside
    assert (f"**{nse:.2f}** (" in markdown_row("x", statistics)) is not inside


@pytest.mark.parametrize(("shift", "biased"), [(2.5, []), (2.7, ["y"]), (-2.5, []), (-2.7, ["y"])])
def test_a_mean_error_in_its_standard_errors(shift: float, biased: list[str]) -> None:
    z = drawn(1.0)
    z -= z.mean(axis=0)
    z[:, 4] += shift * z[:, 4].std(ddof=1) / 10  # 10: the root of the number of sessions
    statistics = statistics_of(rows(z))
    assert statistics.means == pytest.approx([0, 0, 0, 0, shift, 0], abs=1e-9)
    assert statistics.biased == biased
    assert (f"**{shift:+.1f}**" in markdown_row("x", statistics)) is bool(biased)


def test_rms_by_sigma_tells_the_parameters_apart() -> None:
    statistics = statistics_of(rows(drawn(1.0) / np.sqrt(np.mean(drawn(1.0) ** 2, axis=0)) * [1, 2, 3, 4, 5, 6]))
    assert statistics.ratios == pytest.approx([1, 2, 3, 4, 5, 6])


def test_sessions_without_a_result_and_rejected_ones_are_counted() -> None:
    table = rows(drawn(1.0, 10))
    table.loc[:2, "accepted"] = False
    table.loc[:2, "nse"] = 60.0
    table.loc[0, [name for name in table if name != "accepted"]] = np.nan
    statistics = statistics_of(table)
    assert (statistics.sessions, statistics.accepted, statistics.without_result) == (10, 7, 1)
    assert statistics.nse == pytest.approx((120 + table["nse"][3:].sum()) / 9)
    assert statistics.nse_accepted == pytest.approx(table["nse"][3:].mean())
    assert statistics.band == nse_band(9)
    assert np.isfinite(statistics.ratios).all()
    assert "| 10, 1 without a result | 7 |" in markdown_row("x", statistics)


def test_the_table_has_a_line_for_each_campaign_with_rows(tmp_path: Path) -> None:
    rows(drawn(1.0)).to_parquet(tmp_path / path_of(STRESS[1]).name)
    rows(drawn(4.0), "laser_").to_parquet(tmp_path / "laser.parquet")
    head, rule, *lines = table_of(tmp_path).splitlines()
    assert head == HEAD
    assert len({line.count("|") for line in (head, rule, *lines)}) == 1
    assert [line.split(" | ")[0] for line in lines] == ["| drift within 10 s", "| the laser's own calibration"]
    assert "**24.00**" in lines[1]  # by its total sigmas, which are twice the random ones


def block(error: np.ndarray, sigma: np.ndarray) -> dict[str, object]:
    """An estimate that is off by small errors (6,) in rad and m; its total sigmas are twice its random ones."""
    x, y, z = -error[:3]
    R = np.array([[1, -z, y], [z, 1, -x], [-y, x, 1]])
    covariance, total = np.diag(sigma**2), 4 * np.diag(sigma**2)
    return {
        "R_body_from_laser": R.tolist(), "lever_arm_m": (-error[3:]).tolist(),
        "covariance": covariance.tolist(), "covariance_total": total.tolist(),
    }  # fmt: skip


TRUTH = {"laser": {"R_body_from_laser": np.eye(3).tolist(), "lever_arm_m": [0.0] * 3}}


def test_columns_of_a_mount_have_errors_and_both_sigmas() -> None:
    z = np.array([1.0, -2.0, 0.5, 1.5, -0.5, 2.0])
    row = error_columns(block(z * SIGMAS * UNITS, SIGMAS * UNITS), TRUTH, "laser", "a_")
    assert row["a_nse"] == pytest.approx(np.sum(z**2), rel=1e-3)
    assert row["a_nse_total"] == pytest.approx(np.sum(z**2) / 4, rel=1e-3)
    for k, name in enumerate(NAMES):
        found = [row[f"a_{kind}_{name}"] for kind in ("error", "sigma", "total")]
        assert found == pytest.approx([z[k] * SIGMAS[k], SIGMAS[k], 2 * SIGMAS[k]], rel=1e-3)
    without = error_columns({"covariance": None, "covariance_total": None}, TRUTH, "laser", "a_")
    assert without.keys() == row.keys()
    assert np.isnan(list(without.values())).all()


def test_two_results_of_the_laser_are_compared_where_asked() -> None:
    """Of two results with total sigmas of 2 each the difference has a sigma of √8."""
    sigma = SIGMAS * UNITS
    first, second = block(np.zeros(6), sigma), block(np.sqrt(8) * np.array([3.0, -1.0, 9, 9, 9, 9]) * sigma, sigma)
    z, probability = agreement(first, second, ["pitch", "roll"])
    assert np.abs(z) == pytest.approx([3, 1], rel=1e-3)
    assert z[0] * z[1] < 0
    assert probability == pytest.approx(np.exp(-10 / 2), rel=0.01)  # chi-squared with two degrees of freedom


@pytest.mark.parametrize(("agreeing", "word"), [(186, "enough"), (185, "TOO FEW")])
def test_ninety_three_of_a_hundred_pairs_must_agree(agreeing: int, word: str) -> None:
    probability = np.where(np.arange(200) < agreeing, 0.051, 0.049)
    table = pd.DataFrame({"p_both": probability, "p_all": 1.0, "held_calm": "x y z", "held_rough": ""})
    table = table.assign(accepted_calm=True, accepted_rough=True, **{f"z_{name}": np.nan for name in NAMES})
    assert f"good enough in both, jointly: {agreeing} of 200 agree, {agreeing / 2:.1f} %, {word} (93 %" in report(table)


@pytest.mark.parametrize(("accepted", "reasons"), [(True, ""), (False, "wet P1 is turned")])
def test_a_single_session_shows_its_verdict_with_the_reasons(accepted: bool, reasons: str) -> None:
    row = rows(np.array([[1.0, -2.0, 0.5, 1.5, -0.5, 2.0]])).to_dict("records")[0]
    row |= {"campaign": "x", "seed": 8, "accepted": accepted, "reasons": reasons, "warnings": ""}
    first, errors, *rest = session_report(row).splitlines()
    word = "accepted" if accepted else "rejected"
    assert first == f"x, seed 8: {word}; normalised squared error 11.75, by the total covariance 2.94"
    assert "pitch +1.0, roll -2.0, yaw +0.5" in errors
    assert rest == ([] if accepted else [f"  reasons: {reasons}"])
