"""The laser's own calibration by the command line: its run folder, session.yaml, page and recordings."""

import json
import shutil
from pathlib import Path

import laspy
import numpy as np
import pandas as pd
import pytest
import yaml

from pipeline.config.load import load_session
from pipeline.exports.registry import TARGETS
from tests.support.pages import Page
from tests.support.places import Place, Told, poolcal, simulate
from tests.support.programs import READERS
from tests.support.recordings import read, text

STAGES = ("ingest", "georeference", "segment", "fit_planes", "adjust", "report")
BADGES = ("yes", "no", "part")
EXACT = {"face_sigma_deg": 0.001, "plumb_sigma_deg": 0.001, "face_sigma_m": 0.0002}
SURVEYED = EXACT | {"origin_sigma_m": 0.001, "azimuth_sigma_deg": 0.002}


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    off = {"coarse_angle_deg": 0.3, "coarse_lever_m": 0.03}
    return simulate(tmp_path_factory.mktemp("laser") / "session", laser=off)


@pytest.fixture
def laser(template: Path, tmp_path: Path) -> Place:
    made = Place(template, tmp_path)
    made.mend()
    made.edit_config("laser_fit", **SURVEYED)
    return made


def calibrate(place: Place, *more: object) -> Told:
    words = ("laser", place.session, "--config", place.config, "--run", place.run, "--jobs", 1)
    pictures = () if "--report" in more else ("--no-report", "--no-recordings")
    return poolcal(*words, *pictures, *more)


@pytest.fixture(scope="module")
def looked_at(template: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run folder of a calibration that wrote nothing into the session. Nobody changes it."""
    place = Place(template, tmp_path_factory.mktemp("looked_at"))
    place.mend()
    place.edit_config("laser_fit", **SURVEYED)
    assert calibrate(place, "--no-write").status == 0
    assert (place.session / "session.yaml").read_bytes() == (template / "session.yaml").read_bytes()
    return place.run


@pytest.fixture
def done(laser: Place, looked_at: Path) -> Place:
    shutil.copytree(looked_at, laser.run)
    return laser


def mount(place: Place) -> dict[str, float]:
    return load_session(place.session).laser.mount.model_dump()


def test_the_mount_found_goes_into_the_session_and_from_there_into_the_sonars_total(laser: Place) -> None:
    truth = json.loads(laser.template.with_name("session.truth.json").read_text())["laser"]["mount"]
    before, coarse = (laser.session / "session.yaml").read_bytes(), mount(laser)
    told = calibrate(laser)
    assert told.status == 0, told.err + told.out
    assert "laser mount" in told.out
    assert "session.yaml: laser.mount written; what was there is in session.1.yaml" in told.out
    assert (laser.session / "session.1.yaml").read_bytes() == before
    after = mount(laser)
    for key, value in truth.items():
        assert after[key] == pytest.approx(value, abs=0.03 if key.endswith("_deg") else 0.006), key
    given = load_session(laser.session).laser
    assert given.mount_origin is not None
    assert (given.mount_origin.method, given.mount_origin.held) == ("fine", ())
    block = json.loads((laser.run / "report" / "calibration.json").read_text())["laser"]
    np.testing.assert_allclose(given.mount_covariance, block["covariance_total"], rtol=1e-8)
    assert given.mount_origin.coarse is not None
    assert given.mount_origin.coarse.mount.model_dump() == coarse
    assert given.mount_origin.coarse.covariance is None
    assert calibrate(laser, "--no-write").status == 0  # the same passes again: their information does not count twice
    again = json.loads((laser.run / "report" / "calibration.json").read_text())["laser"]
    sigma = np.sqrt(np.diag(block["covariance_total"]))
    np.testing.assert_allclose(np.sqrt(np.diag(again["covariance_total"])), sigma, rtol=0.01)
    assert np.all(np.abs(np.subtract(again["lever_arm_m"], block["lever_arm_m"])) < 0.1 * sigma[3:])
    sonar = Place(laser.session, laser.folder / "sonar")
    sonar.folder.mkdir()
    sonar.mend()
    assert sonar.calibrate().status in (0, 1)
    total = np.array(sonar.result()["mbes"]["covariance_total"])
    random = np.array(sonar.result()["mbes"]["covariance"])
    laser_alone = np.array(block["covariance_total"])
    for k in (3, 4, 5):  # how much of each angle, tests/stages/test_laser.py asks of whole calibrations
        assert total[k, k] - random[k, k] >= 0.8 * laser_alone[k, k]


def test_its_mount_and_points_go_to_other_programs(done: Place) -> None:
    """The mount found, not the coarse one of the settings, in every form that takes a laser; and its points alone."""
    block = json.loads((done.run / "report" / "calibration.json").read_text())["laser"]
    found = np.reshape(block["R_body_from_laser"], (3, 3)), np.array(block["lever_arm_m"])
    coarse = mount(done)
    assert abs(block["mount"]["roll_deg"] - coarse["roll_deg"]) > 0.01  # else nothing is told apart
    for name, target in TARGETS.items():
        file = done.folder / f"激光 {name}{target.suffix}"
        told = poolcal("export", done.run, "--to", name, "--out", file)
        if target.sensor == "mbes":
            assert (told.status, file.exists()) == (2, False)
            assert "calibrates the laser alone, and holds no sonar" in told.err
            continue
        assert told.status == 0, told.err
        assert f"{file}: the laser's mount for {target.title}" in told.out
        if name in ("json", "yaml", "csv"):
            assert "R_body_from_laser" in file.read_text("utf-8")
        R, position = READERS[name](file.read_text("utf-8"), "YPR")
        np.testing.assert_allclose(R, found[0], atol=3e-6)
        np.testing.assert_allclose(position, found[1], atol=6e-5)
        told = poolcal("mount", file, "--from", name, "--session", done.session, "--sensor", "laser")
        assert told.status == 0, told.err
        for key, value in mount(done).items():
            assert value == pytest.approx(block["mount"][key], abs=6e-5), (name, key)
    for suffix in ("las", "laz"):
        file = done.folder / f"cloud.{suffix}"
        assert poolcal("export", done.run, "--to", suffix, "--out", file).status == 0
        cloud = laspy.read(file)
        rows = pd.read_parquet(done.run / "adjust" / "residuals.parquet")
        assert len(cloud.points) >= len(rows) > 1000
        assert set(np.unique(cloud.user_data)) == {1}
        rms = float(np.sqrt(np.mean(np.square(cloud["residual_mm"]))))
        assert rms == pytest.approx(1e3 * float(np.sqrt(np.mean(np.square(rows["residual_m"])))), abs=0.2)


def test_nothing_is_written_where_it_is_only_looked_at_or_rejected(done: Place) -> None:
    before = (done.session / "session.yaml").read_bytes()
    told = calibrate(done, "--no-write")
    assert (told.status, told.err.count(": up to date")) == (0, len(STAGES))
    done.edit_config("verdict", max_sigma_deg=1e-6, max_sigma_m=1e-7)
    told = calibrate(done)
    assert told.status == 1
    assert "no mount parameter is good enough" in told.out
    assert (done.session / "session.yaml").read_bytes() == before
    assert not (done.session / "session.1.yaml").exists()


def test_without_a_sonar_and_a_run_folder_of_its_own(laser: Place) -> None:
    content = yaml.safe_load((laser.session / "session.yaml").read_text())
    words = ("--session", laser.session, "--config", laser.config, "--jobs", 1)
    assert poolcal("stage", "ingest", laser.run, *words).status == 0
    told = calibrate(laser)
    assert told.status == 2
    assert "holds a calibration of the sonar; name another run folder" in told.complaints[0]
    del content["mbes"]
    (laser.session / "session.yaml").write_text(yaml.safe_dump(content, sort_keys=False))
    alone = Place(laser.session, laser.folder / "alone")
    alone.folder.mkdir()
    alone.mend()
    alone.edit_config("laser_fit", **SURVEYED)
    assert calibrate(alone, "--no-write").status == 0
    assert sorted(path.name for path in alone.run.iterdir() if path.is_dir()) == sorted(STAGES)
    again = calibrate(alone, "--no-write")
    assert [f"{name}: up to date" in again.err for name in STAGES] == [True] * len(STAGES)
    assert poolcal("verify", alone.run).status == 0
    assert "mbes: is missing" in poolcal("run", alone.session, "--config", alone.config, "--run", alone.run).err
    assert "holds a calibration of the laser" in poolcal("diff", alone.run, laser.run).err
    assert "is no stage; the stages are ingest, geo" in poolcal("stage", "offsets", alone.run).err


def test_its_page_and_recordings_show_the_laser_alone(laser: Place) -> None:
    laser.edit_config("laser_fit", origin_sigma_m=None, azimuth_sigma_deg=None)
    told = calibrate(laser, "--report", "--recordings", "--no-write")
    assert told.status == 0, told.err
    assert "not drawn" not in told.err
    page = Page((laser.run / "report" / "report.html").read_text("utf-8"))
    assert "The laser's mount" in page.text
    result = json.loads((laser.run / "report" / "calibration.json").read_text())
    held = list(result["held"])
    assert held
    found = ", ".join(name for name in ("roll", "pitch", "yaw", "x", "y", "z") if name not in held)
    assert (result["verdict"], result["verdict_in_words"]) == ("accepted", f"accepted in part: {found}")
    for said in (told.out, text(read(laser.run, "report"), "/tables/summary")):
        assert f": ACCEPTED IN PART: {found}\n  not good enough: {', '.join(held)}\n" in said
    (shown,) = [attributes["class"] for attributes in page.named("span") if attributes.get("class") in BADGES]
    assert shown == "part"
    assert f"accepted in part: {found}" in page.text
    assert f"Not good enough: {', '.join(held)}." in page.text
    assert "above the verdict's limits" in page.text
    rows = page.table("", "roll, °", "pitch, °", "yaw, °", "x, mm", "y, mm", "z, mm")
    sources = {row[0] for row in rows}
    assert {"the target's design: directions, distances, parallel faces", "the coarse mount"} <= sources
    sigma = result["laser"]["sigma_total"]
    expected = np.r_[np.array(sigma["rotation_vector_deg"])[[1, 0, 2]], 1000 * np.array(sigma["lever_arm_m"])]
    parts = np.array([row[1:] for row in rows], dtype=float)
    np.testing.assert_allclose(np.sqrt((parts**2).sum(axis=0)), expected, rtol=0.01, atol=0.0002)
    for word in ("Three ways", "Agreement of the planes", "soundings on", "water's load"):
        assert word not in page.text
    assert sorted(path.stem for path in laser.run.glob("*/*.rrd")) == sorted(STAGES)
