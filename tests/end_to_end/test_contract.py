"""calibration.json and .yaml, and the exit status, as other programs rely on them."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from tests.support.places import Place, Told, poolcal, result_of
from tests.support.weak_sessions import only_the_wall

KEYS = {"schema", "session", "verdict", "reasons", "reason_codes", "mbes", "methods", "inputs", "software"}
BLOCK = {"R_body_from_mbes", "lever_arm_m", "mount", "correction", "sigma", "covariance"}
METHODS = ("patent_sequential", "patent_alternating", "patent_literal", "adjustment")
MOUNT = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m")


@pytest.fixture(scope="module")
def result(undisturbed: tuple[Path, Told]) -> dict[str, Any]:
    return result_of(undisturbed[0])


@pytest.fixture(scope="module")
def coarse(small: Path) -> dict[str, float]:
    text = yaml.safe_load((small / "session.yaml").read_text(encoding="utf-8"))
    mount: dict[str, float] = text["mbes"]["mount"]
    return mount


def blocks(result: dict[str, Any]) -> list[dict[str, Any]]:
    return [result["mbes"], *result["methods"].values()]


def test_keys(result: dict[str, Any]) -> None:
    assert result.keys() >= KEYS
    assert result["schema"] == 1
    assert result["session"] == "2026-05-12_small"
    assert result["verdict"] == "accepted"
    assert result["reasons"] == result["reason_codes"] == []
    assert len(result["warnings"]) == len(result["warning_codes"])
    assert tuple(result["methods"]) == METHODS
    assert result["mbes"] == result["methods"]["adjustment"]
    assert set(result["inputs"]) == {
        "ins/ins.gps", "laser/pass_0.las", "laser/pass_1.las", "mbes/pass_0.xtf", "mbes/pass_1.xtf",
    }
    assert all(len(digest) == 64 for digest in result["inputs"].values())
    assert {"poolcal", "python", "numpy", "pyarrow"} <= result["software"].keys()


def test_every_method_has_the_same_keys(result: dict[str, Any]) -> None:
    for block in blocks(result):
        assert block.keys() >= BLOCK
    assert len({tuple(sorted(block)) for block in blocks(result)}) == 1


def test_shapes(result: dict[str, Any]) -> None:
    for block in blocks(result):
        assert np.shape(block["R_body_from_mbes"]) == (3, 3)
        assert np.shape(block["lever_arm_m"]) == (3,)
        assert tuple(block["mount"]) == MOUNT
        assert list(block["correction"]) == ["rotation_vector_deg", "lever_arm_m"]
        assert np.shape(list(block["correction"].values())) == (2, 3)
    assert list(result["mbes"]["sigma"]) == ["rotation_vector_deg", "lever_arm_m"]
    for method in METHODS[:3]:
        assert result["methods"][method]["sigma"] is None
        assert result["methods"][method]["covariance"] is None


def test_covariance_and_sigma_are_of_one_another(result: dict[str, Any]) -> None:
    covariance = np.array(result["mbes"]["covariance"])
    assert covariance.shape == (6, 6)
    np.testing.assert_array_equal(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance / np.outer(*2 * [np.sqrt(np.diag(covariance))])).min() > 0
    sigma = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(result["mbes"]["sigma"]["rotation_vector_deg"], np.degrees(sigma[:3]), rtol=1e-12)
    np.testing.assert_allclose(result["mbes"]["sigma"]["lever_arm_m"], sigma[3:], rtol=1e-12)


def test_noise_and_systematic_errors_make_up_the_total(result: dict[str, Any]) -> None:
    """E R Eᵀ of each block; every parameter once."""
    total, names = np.array(result["mbes"]["covariance"]), []
    for block in result["systematic"].values():
        effects = np.array(list(block["effects"].values())).T
        correlation = np.eye(effects.shape[1]) if block["correlation"] is None else np.array(block["correlation"])
        total = total + effects @ correlation @ effects.T
        names += list(block["effects"])
    np.testing.assert_allclose(total, result["mbes"]["covariance_total"], rtol=1e-9, atol=1e-18)
    assert len(names) == len(set(names)) > 20
    assert {key: result["limits"][key] for key in ("max_sigma_deg", "max_sigma_m", "purpose")} == {
        "max_sigma_deg": 0.05, "max_sigma_m": 0.005, "purpose": "pool",
    }


def test_matrix_mount_and_correction_say_the_same(result: dict[str, Any], coarse: dict[str, float]) -> None:
    """R_body_from_mbes = Exp(correction) · coarse, and the mount's angles are those of that matrix: all by scipy."""
    R_coarse = Rotation.from_euler("ZXY", [coarse[f"{axis}_deg"] for axis in ("yaw", "pitch", "roll")], degrees=True)
    for block in blocks(result):
        R_body_from_mbes = np.array(block["R_body_from_mbes"])
        np.testing.assert_allclose(R_body_from_mbes @ R_body_from_mbes.T, np.eye(3), atol=1e-14)
        turn = Rotation.from_rotvec(block["correction"]["rotation_vector_deg"], degrees=True)
        np.testing.assert_allclose((turn * R_coarse).as_matrix(), R_body_from_mbes, atol=1e-13)
        yaw, pitch, roll = Rotation.from_matrix(R_body_from_mbes).as_euler("ZXY", degrees=True)
        mount = block["mount"]
        np.testing.assert_allclose([roll, pitch, yaw, *block["lever_arm_m"]], [mount[k] for k in MOUNT], atol=1e-11)
        total = np.add([coarse[f"{axis}_m"] for axis in "xyz"], block["correction"]["lever_arm_m"])
        np.testing.assert_allclose(total, block["lever_arm_m"], atol=1e-14)


def test_yaml_says_what_json_says(undisturbed: tuple[Path, Told], result: dict[str, Any]) -> None:
    text = (undisturbed[0] / "report" / "calibration.yaml").read_text(encoding="utf-8")
    assert yaml.safe_load(text) == result


def test_the_screen_says_what_json_says(undisturbed: tuple[Path, Told], result: dict[str, Any]) -> None:
    said = undisturbed[1].out
    assert said.startswith("2026-05-12_small: ACCEPTED\n")
    for key in MOUNT:
        assert f"{result['mbes']['mount'][key]:.4f}" in said


# --- the answer no ---------------------------------------------------------------------------------------------------
@pytest.fixture
def done(place: Place, undisturbed: tuple[Path, Told]) -> Place:
    shutil.copytree(undisturbed[0], place.run)
    return place


def test_rejected_by_the_limits(done: Place, result: dict[str, Any]) -> None:
    """Status 1, reasons on the screen and in the file, and the values all the same."""
    done.edit_config("verdict", max_sigma_deg=1e-6)
    told = done.calibrate()
    assert told.status == 1
    rejected = done.result()
    assert rejected["verdict"] == "rejected"
    assert rejected["reason_codes"] == ["sigma_above_limit"] * 3
    for reason, axis in zip(rejected["reasons"], ("roll", "pitch", "yaw"), strict=True):
        assert axis in reason
        assert f" because {reason} " in " ".join(told.out.split())
    assert max(map(len, told.out.splitlines())) <= 104  # sentences 100; the line of the target's place is not cut
    assert "Do not use these values." in told.out
    for words in ("Use the total sigma", "Next: ", "poolcal export"):
        assert words not in told.out
    assert rejected["mbes"] == result["mbes"]
    assert yaml.safe_load((done.run / "report" / "calibration.yaml").read_text("utf-8")) == rejected
    assert done.calibrate().status == 1  # with nothing to do the answer stays no
    assert not done.calibrate().complaints


@pytest.mark.parametrize("method", [method for method in METHODS if method != "patent_literal"])
def test_another_method_as_the_result(done: Place, result: dict[str, Any], method: str) -> None:
    """Whatever the verdict on it; if it is no, the reasons are that method's own."""
    done.edit_config("", result=method)
    told = done.calibrate()
    again = done.result()
    assert told.status == (0 if again["verdict"] == "accepted" else 1)
    assert all(method in reason for reason in again["reasons"])
    assert again["mbes"] == result["methods"][method]
    assert again["methods"] == result["methods"]


def test_the_literal_form_is_shown_and_never_the_result(done: Place, result: dict[str, Any]) -> None:
    """It alone has a warning; as ``result`` it is refused in one line, and the run stays as it was."""
    assert [method for method, block in result["methods"].items() if block["warning"]] == ["patent_literal"]
    done.edit_config("", result="patent_literal")
    told = done.calibrate()
    assert told.status == 2
    assert len(told.err.splitlines()) == 1
    assert "result = 'patent_literal': is shown beside the result, and is never the result itself" in told.err
    assert done.result() == result


def test_rank_deficient_is_an_answer(small: Path, tmp_path: Path) -> None:
    """Only soundings on the wall: nothing tells the shift along it. Rejected with nulls and reasons, never an error."""
    place = only_the_wall(small, tmp_path)
    told = place.calibrate()
    assert told.status == 1, told.err
    result = place.result()
    assert result["verdict"] == "rejected"
    assert result["reasons"]
    adjusted = result["methods"]["adjustment"]
    assert adjusted.keys() >= BLOCK
    assert adjusted["R_body_from_mbes"] is None
    assert adjusted["lever_arm_m"] is None
    assert adjusted["mount"] is None
    assert adjusted["sigma"] is None
    assert adjusted["covariance"] is None
    assert adjusted["correction"] == {"rotation_vector_deg": None, "lever_arm_m": None}
    assert result["mbes"] == adjusted
    assert "nan" not in (place.run / "report" / "calibration.json").read_text(encoding="utf-8").lower()
    assert "REJECTED" in told.out


def test_weak_geometry_is_an_answer_with_values(small: Path, tmp_path: Path) -> None:
    """One pass at one distance: yaw and lever arm y are strongly correlated."""
    place = Place(small, tmp_path)
    place.mend()
    for path in (place.session / "mbes" / "pass_1.xtf", place.session / "laser" / "pass_1.las"):
        path.unlink()
    told = place.calibrate()
    assert told.status == 1, told.out
    result = place.result()
    assert result["verdict"] == "rejected"
    assert np.shape(result["mbes"]["covariance"]) == (6, 6)
    assert any("yaw" in reason or "lever arm y" in reason for reason in result["reasons"])


def test_verify_of_a_real_run(undisturbed: tuple[Path, Told]) -> None:
    told = poolcal("verify", undisturbed[0], "--jobs", 1)
    assert (told.status, told.err) == (0, "")
    assert "everything is as recorded" in told.out
