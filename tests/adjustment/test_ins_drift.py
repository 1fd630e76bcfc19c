"""The drift that the adjustment allows the INS: by session.yaml, or by what its files say of its accuracy."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.adjustment.ins_drift import drift_figures_table, drift_model, drift_prior, pose_noise, sigmas_from_files
from pipeline.config.session import Drift, Ins
from pipeline.config.yaml_models import parse
from pipeline.maths.adjustment.drift_likelihood import EXACT, DriftFigures
from pipeline.readers.file_summaries import thin_sigmas

NS = 1_000_000_000
INS: dict[str, Any] = {"files": ["a"], "format": "novatel"}
PASSES = pd.DataFrame({"start_ns": [100 * NS, 200 * NS], "end_ns": [110 * NS, 210 * NS]})
GIVEN = {"horizontal_m": 0.1, "heading_deg": 0.5}
NAN = float("nan")


def ins(**keys: Any) -> Ins:
    return parse(Ins, INS | keys, "session.yaml")


def sigmas(*rows: tuple[float, float, float, float, float, float, float]) -> pd.DataFrame:
    names = ("north_m", "east_m", "up_m", "roll_deg", "pitch_deg", "heading_deg")
    table = pd.DataFrame([row[1:] for row in rows], columns=list(names), dtype=np.float64)
    table.insert(0, "t_ns", np.array([round(row[0] * NS) for row in rows], dtype=np.int64))
    return table


ROWS = sigmas(
    (99.9, 9, 9, 9, 9, 9, 9),  # before the passes
    (100.0, 0.03, 0.04, 0.05, 0.006, 0.008, 0.1),
    (110.0, 0.003, 0.004, 0.01, 0.0006, 0.0008, 0.02),
    (150.0, 9, 9, 9, 9, 9, 9),  # between them
    (205.0, 0.3, 0.4, 0.06, 0.06, 0.08, 0.3),
)


@pytest.mark.parametrize(
    ("keys", "source"),
    [
        ({}, "files"), ({"drift": GIVEN}, "settings"), ({"drift": {}}, "settings"),
        ({"drift": GIVEN, "drift_from": "files"}, "files"), ({"drift_from": "settings"}, "settings"),
    ],
)  # fmt: skip
def test_whose_figures_go_first(keys: dict[str, Any], source: str) -> None:
    """And what run.yaml has of it, defaults filled in, says the same again."""
    one = ins(**keys)
    assert one.drift_from == source
    assert parse(Ins, one.model_dump(mode="json"), "run.yaml") == one


def test_medians_within_the_passes() -> None:
    """A plane position, and roll and pitch, have the root mean square of their two sigmas."""
    found = drift_model(ins(), ROWS, PASSES)
    half = np.sqrt(0.5)
    assert found.horizontal_m == pytest.approx(0.05 * half)
    assert found.vertical_m == pytest.approx(0.05)
    assert found.roll_pitch_deg == pytest.approx(0.01 * half)
    assert found.heading_deg == pytest.approx(0.1)
    assert found.time_constant_s == Drift().time_constant_s


def test_the_time_constant_is_the_sessions() -> None:
    found = drift_model(ins(drift={"time_constant_s": 77.0}, drift_from="files"), ROWS, PASSES)
    assert (found.time_constant_s, found.vertical_m) == (77.0, pytest.approx(0.05))


def test_explicit_figures_stand() -> None:
    one = ins(drift=GIVEN)
    assert drift_model(one, ROWS, PASSES) == one.drift == Drift(**GIVEN)
    assert sigmas_from_files(one, ROWS, PASSES) == {}


@pytest.mark.parametrize("rows", [ROWS.iloc[:0], ROWS.iloc[[0, 3]], pd.DataFrame(columns=ROWS.columns)])
def test_without_any_in_the_passes_the_sessions_stand(rows: pd.DataFrame) -> None:
    assert drift_model(ins(drift=GIVEN, drift_from="files"), rows, PASSES) == Drift(**GIVEN)
    assert drift_model(ins(), rows, PASSES) == Drift()


def test_what_is_not_told_is_the_sessions() -> None:
    some = sigmas((100.0, NAN, NAN, 0.07, 0.003, 0.004, NAN))
    assert sorted(sigmas_from_files(ins(), some, PASSES)) == ["roll_pitch_deg", "vertical_m"]
    found = drift_model(ins(drift=GIVEN, drift_from="files"), some, PASSES)
    assert (found.horizontal_m, found.heading_deg) == (0.1, 0.5)
    assert (found.vertical_m, found.roll_pitch_deg) == (0.07, pytest.approx(np.sqrt(12.5) * 1e-3))


def test_two_rows_a_second_are_kept() -> None:
    t_ns = np.arange(0, 10 * NS, NS // 200) + 7
    order = np.random.default_rng(0).permutation(len(t_ns))
    kept = thin_sigmas({"t_ns": t_ns[order], "up_m": t_ns[order] / NS})
    assert kept["t_ns"].tolist() == [7 + k * NS // 2 for k in range(20)]
    assert kept["up_m"].tolist() == [t / NS for t in kept["t_ns"].tolist()]
    assert thin_sigmas({}) == {}


def test_the_table_has_each_figure_in_its_unit() -> None:
    drift = {"horizontal_m": 0.01, "vertical_m": 0.02, "roll_pitch_deg": 0.03, "heading_deg": 0.04}
    settings = ins(drift=drift | {"time_constant_s": 50.0})
    noise = pose_noise(settings.drift, settings.white)
    covariance, deviation = np.diag([0.01, 0.04, 0.09]), np.array([1.0, 2.0, -3.0])
    found = DriftFigures(noise.drifting(2.0, 3.0, 0.5), np.zeros(3), covariance, deviation)
    table = drift_figures_table(noise, found).set_index("figure")
    assert table["configured"].to_dict() == pytest.approx(drift | {"time_constant_s": 50.0})
    factors = {"horizontal_m": 2, "vertical_m": 2, "roll_pitch_deg": 3, "heading_deg": 3, "time_constant_s": 0.5}
    assert (table["estimated"] / table["configured"]).to_dict() == pytest.approx(factors)
    assert table["sigma_log"].tolist() == pytest.approx([0.1, 0.1, 0.2, 0.2, 0.3])
    assert table["deviation"].tolist() == [1.0, 1.0, 2.0, 2.0, -3.0]


def test_how_well_the_figures_are_known_is_a_factor() -> None:
    assert drift_prior(ins(drift_within={"sigmas": 1.0, "time_constant": 1.0}).drift_within) == EXACT
    assert drift_prior(ins().drift_within).sigma == pytest.approx(np.log(2.0))
    assert drift_prior(ins().drift_within).time_constant == pytest.approx(np.log(3.0))
