"""The report's table of systematic errors."""

import numpy as np
import pandas as pd
import pytest

from pipeline.maths.adjustment.mean_tests import joint_limit
from pipeline.maths.mount_parameters import MOUNT_NAMES
from pipeline.results.pages.parameter_tests import parameter_test_rows, untold_parameters

LEVEL = 0.001


def freed(*rows: dict[str, object]) -> pd.DataFrame:
    usual = {"estimated": False, "known": False, "value": 1e-4, "sigma": 1e-3, "considered": 5e-4, "expected": 1.2e-3}
    effects = {f"effect_{name}": 1e-3 for name in MOUNT_NAMES}
    return pd.DataFrame([{"unknown": "mbes_latency"} | usual | effects | row for row in rows])


def test_an_error_of_the_size_that_is_found_is_found_in_95_of_100_sessions() -> None:
    """The estimate scatters about the error, with what is expected of it less its own a-priori error."""
    (row,) = parameter_test_rows(freed({}), LEVEL)
    size_s = float(row["found_from"].removesuffix(" ms")) / 1000
    estimates = np.random.default_rng(1).normal(size_s, np.sqrt(1.2e-3**2 - 5e-4**2), 200_000)
    assert np.mean(estimates > joint_limit(1, LEVEL) * 1.2e-3) == pytest.approx(0.95, abs=0.01)
    assert (row["considered"], row["normalised"]) == ("0.5 ms", pytest.approx(1 / 12))


@pytest.mark.parametrize(("value", "beyond"), [(3.9e-3, False), (4.0e-3, True), (-4.0e-3, True)])  # limit 3.29 x 1.2
def test_what_the_points_contradict_is_marked(value: float, beyond: bool) -> None:
    (row,) = parameter_test_rows(freed({"value": value}), LEVEL)
    assert row["beyond"] == beyond
    assert row["words"] == f"the sonar's clock: its latency is {1000 * value:+.0f} ± 1 ms more than mbes.latency_s says"


def test_only_tested_parameters_of_all_points_have_a_row() -> None:
    others = [
        {"unknown": "face_P1-1"}, {"unknown": "rotation_x"}, {"estimated": True},
        {"unknown": "surfaces_P1", "value": np.nan, "expected": np.nan},
    ]  # fmt: skip
    assert list(parameter_test_rows(freed(*others), LEVEL)) == []
    wet = freed(*({"unknown": f"wet_P2_turn_{number}"} for number in "12"))
    turned, leaning = (row["words"] for row in parameter_test_rows(wet, LEVEL))
    assert "are turned by +0.01 ± 0.06° counter-clockwise from above, against the dry ones" in turned
    assert "lean away from the boat by +0.01 ± 0.06°, against the dry ones" in leaning


def test_sizes_are_plain_numbers_in_the_parameters_unit() -> None:
    names = ("projector_z", "wet_return-south_shift", "sound_speed_gradient", "laser_rotation_x")
    rows = [*parameter_test_rows(freed(*({"unknown": name, "considered": 0.12} for name in names)), LEVEL)]
    assert [row["considered"] for row in rows] == ["120 mm", "120 mm", "0.12 (m/s)/m", "6.9 °"]


def test_what_the_points_do_not_tell_is_named() -> None:
    unknown = {"value": np.nan, "sigma": np.nan, "expected": np.nan, "considered": 0.005}
    still = {f"effect_{name}": 0.0 for name in MOUNT_NAMES}
    rows = [{"unknown": "projector_y"}, {"unknown": "wet_H_bow"} | still, {"unknown": "surfaces_P1"}]
    assert untold_parameters(freed({}, *(unknown | row for row in rows))) == ["the transmitter's place, y (± 5 mm)"]
