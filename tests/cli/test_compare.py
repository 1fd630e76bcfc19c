"""The demo's comparison: errors in the sense of the covariance, and an answer."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.errors import ArtefactError, ConfigError
from pipeline.report.method_blocks import WARNINGS
from pipeline.run.settings import load_settings, write_settings
from stages.commands.compare import compare_with_truth, errors_of, read_truth
from tests.support.toy_run import Pool

EPSILON_DEG, LEVER_ERROR_M = np.array([0.01, -0.02, 0.03]), np.array([0.001, -0.002, 0.003])
SIGMA = {"rotation_vector_deg": [0.01] * 3, "lever_arm_m": [0.001] * 3}
MOUNT = {"roll_deg": -48.8, "pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.3, "y_m": 0.2, "z_m": -2.0}
NOTHING: dict[str, Any] = {"R_body_from_mbes": None, "lever_arm_m": None, "mount": None, "sigma": None}


def _R_body_from_mbes(mount: dict[str, float]) -> np.ndarray:
    """Written out, not borrowed: Rz(yaw) Rx(pitch) Ry(roll)."""
    r, p, y = (np.radians(mount[f"{name}_deg"]) for name in ("roll", "pitch", "yaw"))
    R_z = np.array([[np.cos(y), -np.sin(y), 0], [np.sin(y), np.cos(y), 0], [0, 0, 1]])
    R_x = np.array([[1, 0, 0], [0, np.cos(p), -np.sin(p)], [0, np.sin(p), np.cos(p)]])
    R_y = np.array([[np.cos(r), 0, np.sin(r)], [0, 1, 0], [-np.sin(r), 0, np.cos(r)]])
    return np.asarray(R_z @ R_x @ R_y)


@pytest.fixture
def found(pool: Pool) -> Path:
    """A run folder whose result is EPSILON and LEVER_ERROR away from the truth beside it."""
    (pool.run_folder / "report").mkdir(parents=True)
    write_settings(pool.run_folder, load_settings(pool.session, pool.config))
    block = {
        "R_body_from_mbes": _R_body_from_mbes(MOUNT).tolist(),
        "lever_arm_m": [0.3, 0.2, -2.0],
        "mount": MOUNT,
        "sigma": SIGMA,
    }
    literal = {**block, "sigma": None, "warning": WARNINGS["patent_literal"]}
    methods = {"patent_sequential": NOTHING, "patent_alternating": {**block, "sigma": None}}
    methods |= {"patent_literal": literal, "adjustment": block}
    _write(pool.run_folder, {"session": "toy", "verdict": "accepted", "reasons": [], "methods": methods})
    R_true = Rotation.from_rotvec(np.radians(EPSILON_DEG)).as_matrix() @ _R_body_from_mbes(MOUNT)
    truth = {"mbes": {"R_body_from_mbes": R_true.tolist(), "lever_arm_m": [0.301, 0.198, -1.997]}}
    (pool.session.parent / "truth.json").write_text(json.dumps(truth))
    return pool.run_folder


def _write(run: Path, result: dict[str, Any]) -> None:
    (run / "report" / "calibration.json").write_text(json.dumps(result))


def _result(run: Path) -> dict[str, Any]:
    return dict(json.loads((run / "report" / "calibration.json").read_text()))


def _truth(run: Path) -> Path:
    return run.parents[1] / "truth.json"


def test_the_error_is_the_covariances_epsilon(found: Path) -> None:
    error = errors_of(_result(found)["methods"]["adjustment"], *read_truth(_truth(found)))
    np.testing.assert_allclose(error, [*EPSILON_DEG, *LEVER_ERROR_M], atol=1e-9)


def test_one_screen_of_numbers(found: Path) -> None:
    text, good = compare_with_truth(found, _truth(found))
    assert good
    assert len(text.splitlines()) <= 30
    assert max(map(len, text.splitlines())) <= 100
    rows = [line.split() for line in text.splitlines()]
    (roll,) = (row for row in rows if row[:1] == ["roll"] and row[-2] != "-")
    assert roll[1:3] == ["0.00000", "-48.80000"]
    assert float(roll[3]) == pytest.approx(-48.82, abs=0.002)
    assert roll[4:] == ["-0.02000", "0.01000", "-2.0", "deg"]
    assert "no result" in text
    assert f"  patent_literal: {WARNINGS['patent_literal']}" in text.splitlines()
    assert "adjustment: every error is within 4 sigma" in text


def test_beyond_four_sigma_is_a_no(found: Path) -> None:
    result = _result(found)
    result["methods"]["adjustment"]["sigma"]["lever_arm_m"] = [0.001, 0.001, 0.0007]
    _write(found, result)
    assert not compare_with_truth(found, _truth(found))[1]


def test_a_rejected_calibration_is_a_no(found: Path) -> None:
    _write(found, _result(found) | {"verdict": "rejected", "reasons": ["weak geometry"]})
    text, good = compare_with_truth(found, _truth(found))
    assert not good
    assert "weak geometry" in text


@pytest.mark.parametrize(("method", "good"), [("patent_alternating", True), ("patent_sequential", False)])
def test_another_result_is_held_to_the_verdicts_limits(pool: Pool, found: Path, method: str, good: bool) -> None:
    pool.config.write_text(pool.config.read_text() + f"result: {method}\n")
    write_settings(found, load_settings(pool.session, pool.config))
    text, answer = compare_with_truth(found, _truth(found))
    assert answer is good
    assert "largest sigma allowed" in text


@pytest.mark.parametrize("content", [None, "", "{}", "[]", '{"mbes": {"R_body_from_mbes": [1], "lever_arm_m": []}}'])
def test_what_is_no_truth(found: Path, content: str | None) -> None:
    _truth(found).unlink()
    if content is not None:
        _truth(found).write_text(content)
    with pytest.raises(ConfigError, match=r"truth\.json"):
        compare_with_truth(found, _truth(found))


@pytest.mark.parametrize(
    ("place", "value"),
    [
        ("R_body_from_mbes", 3), ("R_body_from_mbes", [[1, 0], [0, 1]]), ("R_body_from_mbes", [[0] * 3] * 3),
        ("R_body_from_mbes", [["a"] * 3] * 3), ("lever_arm_m", 3), ("lever_arm_m", {}), ("mount", 3), ("mount", {}),
        ("sigma", 3), ("sigma", {"rotation_vector_deg": 3, "lever_arm_m": 4}), (None, 3), (None, None),
    ],
)  # fmt: skip
def test_a_crafted_result_is_one_line(found: Path, place: str | None, value: object) -> None:
    result = _result(found)
    if place is None:
        result["methods"]["adjustment"] = value
    else:
        result["methods"]["adjustment"][place] = value
    _write(found, result)
    with pytest.raises(ArtefactError, match=r"calibration\.json is not as poolcal writes it"):
        compare_with_truth(found, _truth(found))


def test_reasons_that_are_no_words(found: Path) -> None:
    _write(found, _result(found) | {"reasons": [1]})
    with pytest.raises(ArtefactError, match="not as poolcal writes it"):
        compare_with_truth(found, _truth(found))
