"""Faces off their design, as surveyed; and the target as the laser finds it."""

import contextlib
import json

import numpy as np
import pytest

from pipeline.config.pool import PoolConfig
from pipeline.config.session import Mbes
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from pipeline.run.settings import load_settings, refuse_shallow_cast
from tests.support.effort import often
from tests.support.simulated import QUIET, calibrated, made, through, without_biases


def result(found):
    return json.loads(found["report/calibration.json"])


def test_tops_and_bottoms_that_are_built_too_high_lift_the_sonar(noisy, noisy_found):
    """If all of them are known exactly. (Else a part of the 5 mm is taken for an error of the survey, or of ranges.)"""
    faces = noisy_found["segment/faces"]
    wet = faces[(faces["family"] == "H") & (faces["distance_m"] * faces["normal_z_target_1"] < 0)]
    higher = {row.name: 0.005 * row.normal_z_target_1 for row in wet.itertuples(index=False)}
    session = without_biases(noisy)
    plain, lifted = (
        result(calibrated(session, pool={"as_built": {"faces": faces}}, known=known))["mbes"]["lever_arm_m"]
        for faces, known in (({}, through("segment", noisy_found)), (higher, through("georeference", noisy_found)))
    )
    change = np.subtract(lifted, plain)
    np.testing.assert_allclose(change[:2], 0.0, atol=2e-4)
    assert change[2] == pytest.approx(0.005, rel=0.1)  # the boat's unrest tells the height as well, a tenth of it


@pytest.mark.parametrize("name", often(["P1-7-bottom"], ["P1-7-bottom", "P3-6", "P1-2"]))
def test_a_face_said_to_stand_out_has_that_shift_to_take_back(noisy, noisy_found, name):
    """Outward, whichever way it looks; the survey's own sigma is 0.5 mm, so the reason names this face."""
    found = calibrated(noisy, pool={"as_built": {"faces": {name: 0.005}}})
    before, after = (one["adjust/freed"].set_index("unknown").loc[f"face_{name}"] for one in (noisy_found, found))
    assert after["value"] - before["value"] == pytest.approx(-0.005, abs=0.0005)
    causes = [words for words in result(found)["reasons"] if words.startswith("likely cause")]
    assert any(f"face {name} stands out by -" in words for words in causes)


@pytest.fixture(scope="module")
def bowed():
    """A session whose wet wall the water pushes back by 4 mm, four sigmas of its bow; and its calibration."""
    fault = {"face_faults": [{"faces": ["P2"], "part": "wet", "bow_m": -0.004}]}
    session = made({"surroundings": fault}, seed=4)
    return session, calibrated(session)


def test_a_wet_wall_pushed_back_by_the_water_is_found_and_allowed_for(bowed, errors_of):
    session, found = bowed
    bow = found["adjust/freed"].set_index("unknown").loc["wet_P2_bow"]
    assert bow["value"] == pytest.approx(-0.004, abs=4 * bow["sigma"])
    assert bow["sigma"] < 0.0008
    mbes = result(found)["mbes"]
    assert abs(errors_of(mbes, session.truth)[3]) < 3 * 1e3 * mbes["sigma_mount_total"]["x_m"]


@pytest.mark.thorough
def test_wet_faces_that_are_all_bowed_are_named_together():
    """By 9 mm, nine sigmas of each bow: P1, P2 and P3 explain a part each, and all of it together."""
    fault = {"face_faults": [{"faces": ["P1", "P2", "P3"], "part": "wet", "bow_m": -0.009}]}
    found = calibrated(made({"surroundings": fault}, seed=5))
    first = result(found)["hypotheses"][0]
    assert (first["kind"], first["name"]) == ("set", "wet_bows")
    assert "wet faces of more than one family are bowed" in result(found)["reasons"][0]
    tests = found["adjust/sets"].set_index("set")
    assert tests.loc["wet_bows", "strength"] == first["sigmas"] > found["adjust/freed"]["strength"].max() + 2


@pytest.mark.thorough
def test_without_its_parameter_a_pushed_wall_takes_x_along(bowed, errors_of):
    session, found = bowed
    fixed = calibrated(session, pool={"as_built": {"bow_sigma_m": 0.0}}, known=through("segment", found))
    x, x_fixed = (errors_of(result(one)["mbes"], session.truth)[3] for one in (found, fixed))
    assert abs(x - x_fixed) > 0.7


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["P3-6", "P1-4-top"])
def test_a_face_said_to_stand_out_is_seen_too_far_in(quiet, name):
    found = calibrated(quiet, pool={"as_built": {"faces": {name: 0.004}}})
    number = int(found["segment/faces"].set_index("name").loc[name, "face"])
    rows = found["adjust/patterns"]
    rows = rows[(rows["by"] == "face") & (rows["sensor"] == "laser") & (rows["family"] == name.split("-")[0])]
    if name.endswith("top"):
        rows = found["adjust/patterns"].query("by == 'face' and sensor == 'laser' and family == 'H'")
    off = rows.set_index("low")["mean_m"]
    others = off.drop(number).median()
    assert off[number] - others == pytest.approx(-0.004, abs=0.0012)


def test_an_unknown_face_is_refused(tmp_path, quiet):
    import yaml

    pool = dict(quiet.pool) | {"as_built": {"faces": {"P9-0": 0.001}}}
    path = tmp_path / "pool.yaml"
    path.write_text(yaml.safe_dump(pool))
    (tmp_path / "session.yaml").write_text(yaml.safe_dump(quiet.session))
    with pytest.raises(ConfigError, match=r"as_built.faces: 'P9-0': no face of this target; its faces are .*P1-0-top"):
        load_settings(tmp_path, path)


@pytest.mark.parametrize(
    ("cast", "refused"),
    [
        ([[0.0, 1500.0], [0.01, 1500.0]], True),
        ([[100.0, 1500.0], [101.0, 1500.0]], True),
        ([[0.0, 1500.0], [1.9, 1500.0]], True),
        ([[0.0, 1500.0], [2.1, 1500.0]], False),
        ([[1.0, 1500.0], [9.0, 1500.0]], False),
    ],
)
def test_a_cast_of_less_than_half_the_depth_is_refused(quiet, cast, refused):
    pool = parse(PoolConfig, quiet.pool, "pool")
    session = {**quiet.session["mbes"], "svp": cast}
    with pytest.raises(ConfigError, match=r"mbes\.svp: reaches") if refused else contextlib.nullcontext():
        refuse_shallow_cast(pool.target, parse(Mbes, session, "session"), "session.yaml")


def test_the_target_is_measured_and_what_differs_is_said(quiet, quiet_found):
    right = result(quiet_found)
    found = right["target"]["as_found"]
    assert found["b_m"] == pytest.approx(3.0, abs=1e-4)
    assert found["e_m"] == pytest.approx(0.5, abs=1e-4)
    assert found["corner_deg"] == pytest.approx({"P1": 45.0, "P3": 45.0}, abs=1e-3)
    assert not [words for words in right["warnings"] if "laser finds" in words]
    wrong = result(calibrated(quiet, pool={"target": {"b": 3.02}}))
    assert any("the laser finds b = 3.0000 m where the config has 3.02 m" in words for words in wrong["warnings"])


@pytest.mark.thorough
def test_a_leaning_target_is_said():
    leaning = result(calibrated(made(QUIET, {"surroundings": {"tilt_deg": [0.0, 0.3]}}, seed=6)))
    lean = leaning["target"]["as_found"]["lean_deg"]
    assert abs(lean["P2"]) == pytest.approx(0.3, abs=0.01)
    assert any("out of plumb" in words for words in leaning["warnings"])


def test_each_surface_and_pass_has_its_redundancy_and_its_scatter(noisy_found):
    cells = noisy_found["adjust/cells"]
    many = cells[cells["redundancy"] > 300]
    assert set(many["sensor"]) == {"laser", "mbes"}
    assert len(set(many["pass"])) == 4
    assert (many["redundancy"] < many["count"]).all()
    wall = many[many["family"] == "P2"]  # on the smaller faces some time slots have too few points for a test
    assert (wall["redundancy"] > wall["count"] / 2).all()
    assert np.abs(many["variance_factor"] - 1).max() < 0.3
    assert cells["redundancy"].sum() < noisy_found["adjust/summary"]["redundancy"].iloc[0]
