"""poolcal export and poolcal mount on a finished run: every program, files, refusals, and back into session.yaml."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pandas as pd
import pytest
import yaml

from pipeline.config.load import load_session
from pipeline.errors import ConfigError
from pipeline.exports.registry import TARGETS
from pipeline.exports.source import mounting_of
from pipeline.results.finished_run import FinishedRun
from stages import ORDER
from tests.support.places import Place, Told, edit, poolcal
from tests.support.programs import READERS

MORE = {
    "kluster": ("--serial", "7"),
    "caris": ("--order", "YPR"),
    "caris-hvf": ("--order", "YPR"),
    "hypack": ("--order", "YPR", "--ins-height", "0.9"),
}
KEYS = ("roll_deg", "pitch_deg", "yaw_deg", "x_m", "y_m", "z_m")


def mounts_of(run: Path) -> dict[str, dict[str, float]]:
    result = json.loads((run / "report" / "calibration.json").read_text(encoding="utf-8"))
    laser = yaml.safe_load((run / "run.yaml").read_text(encoding="utf-8"))["session"]["laser"]["mount"]
    return {"mbes": result["mbes"]["mount"], "laser": laser}


@pytest.mark.parametrize("name", sorted(TARGETS))
def test_a_file_comes_back_as_the_coarse_mount(name: str, undisturbed: tuple[Path, Told], place: Place) -> None:
    run, target = undisturbed[0], TARGETS[name]
    file = place.folder / f"水 池{target.suffix}"
    told = poolcal("export", run, "--to", name, "--out", file, *MORE.get(name, ()))
    assert (told.status, told.err) == (0, ""), told.err
    shown = poolcal("export", run, "--to", name, *MORE.get(name, ()))
    assert shown.out == file.read_text(encoding="utf-8")
    path = place.session / "session.yaml"
    path.write_text(path.read_text(encoding="utf-8") + "# 注: kept\n", encoding="utf-8")
    height = MORE["hypack"][2:] if name == "hypack" else ()
    told = poolcal("mount", file, "--from", name, "--session", place.session, *height)
    assert (told.status, told.err) == (0, ""), told.err
    sensor = target.sensor or "mbes"
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    true = mounts_of(run)[sensor]
    for key in KEYS:
        assert content[sensor]["mount"][key] == pytest.approx(true[key], abs=6e-5), key
    assert content[sensor]["mount_origin"]["method"] == "coarse"
    assert content[sensor]["mount_origin"]["file"] == file.name
    assert path.read_text(encoding="utf-8").endswith("# 注: kept\n")
    assert f"{sensor}.mount written" in told.out
    again = poolcal("mount", file, "--from", name, "--session", place.session, *height)
    assert "has these mounts already; not written" in again.out


def test_the_vessels_frame_is_told_once(undisturbed: tuple[Path, Told], place: Place) -> None:
    """The INS 0.5 m above the reference point and turned by 90°: the form says so, and reading needs no options."""
    run, file = undisturbed[0], place.folder / "sheet.txt"
    frame = ("--ins-point", 0.5, "-1", 0.25, "--ins-turn", 0, 0, 90)
    assert poolcal("export", run, "--to", "posmv", "--out", file, *frame).status == 0
    R, position = READERS["posmv"](file.read_text(encoding="utf-8"), "YPR")
    mount = mounts_of(run)["mbes"]
    np.testing.assert_allclose(position, [0.5 - mount["y_m"], -1 + mount["x_m"], 0.25 + mount["z_m"]], atol=1e-4)
    assert R[2, 1] == pytest.approx(np.sin(np.radians(mount["pitch_deg"])), abs=1e-5)
    told = poolcal("mount", file, "--from", "posmv", "--session", place.session, "--no-write")
    assert f"{mount['roll_deg']:.4f} °" in told.out
    assert "not written (--no-write)" in told.out
    told = poolcal("mount", file, "--from", "posmv", "--session", place.session, "--ins-turn", 0, 0, 91)
    assert (told.status, told.err.count("\n")) == (2, 1)
    assert "states another place or turn of the INS" in told.err


def test_a_covariance_comes_back_and_goes_where_another_mount_has_none(
    undisturbed: tuple[Path, Told], place: Place
) -> None:
    path, of_json, of_sheet = place.session / "session.yaml", place.folder / "a.json", place.folder / "a.txt"
    for name, file in (("json", of_json), ("qinsy", of_sheet)):
        assert poolcal("export", undisturbed[0], "--to", name, "--out", file).status == 0
    assert poolcal("mount", of_json, "--from", "json", "--session", place.session).status == 0
    written = yaml.safe_load(path.read_text(encoding="utf-8"))["mbes"]["mount_covariance"]
    result = json.loads((undisturbed[0] / "report" / "calibration.json").read_text(encoding="utf-8"))
    np.testing.assert_allclose(written, result["mbes"]["covariance_total"], rtol=1e-8)
    told = poolcal("mount", of_sheet, "--from", "qinsy", "--session", place.session)
    assert told.status == 0, told.err
    assert yaml.safe_load(path.read_text(encoding="utf-8"))["mbes"]["mount_covariance"] is None
    assert load_session(place.session).mbes.mount_covariance is None


def test_a_rejected_run_only_when_told(undisturbed: tuple[Path, Told], place: Place) -> None:
    shutil.copytree(undisturbed[0], place.run)
    place.edit_config("verdict", max_sigma_deg=1e-6)
    assert place.calibrate().status == 1
    for name, more in (("qinsy", ()), ("laz", ("--out", place.folder / "a.laz"))):
        told = poolcal("export", place.run, "--to", name, *more)
        assert told.status == 2
        assert "was rejected, and must not be used" in told.err
        assert not list(place.folder.glob("a.laz*"))
    told = poolcal("export", place.run, "--to", "qinsy", "--although-rejected")
    assert told.status == 0
    assert "REJECTED: this run was rejected." in told.out
    told = poolcal("export", place.run, "--to", "kluster", "--serial", 7, "--although-rejected")
    assert told.status == 2
    assert (
        poolcal("export", place.run, "--to", "las", "--although-rejected", "--out", place.folder / "a.las").status == 0
    )
    with laspy.open(place.folder / "a.las") as file:
        assert file.header.system_identifier.startswith("REJECTED")
    sheet = place.folder / "a.json"
    assert poolcal("export", place.run, "--to", "json", "--although-rejected", "--out", sheet).status == 0
    told = poolcal("mount", sheet, "--from", "json", "--session", place.session, "--no-write")
    assert "of a rejected run" in told.out


@pytest.mark.parametrize("mount", [None, {}])
def test_values_that_are_not_there_are_not_offered(
    undisturbed: tuple[Path, Told], mount: dict[str, float] | None
) -> None:
    run = FinishedRun.read(undisturbed[0], ORDER)
    block = {**run.result["mbes"], "mount": mount, "no_result": "out of sight"}
    rejected = replace(run, result={**run.result, "verdict": "rejected", "reasons": ["out of sight"], "mbes": block})
    with pytest.raises(ConfigError, match="must not be used") as told:
        mounting_of(rejected, None, although_rejected=False)
    assert ("add --although-rejected" in str(told.value)) == (mount is not None)
    if mount is None:
        with pytest.raises(ConfigError, match="nothing can be exported"):
            mounting_of(rejected, None, although_rejected=True)


def test_points_have_the_residuals_of_the_adjustment(undisturbed: tuple[Path, Told], tmp_path: Path) -> None:
    run, file = undisturbed[0], tmp_path / "cloud.laz"
    told = poolcal("export", run, "--to", "laz", "--out", file)
    assert told.status == 0, told.err
    read = laspy.read(file)
    table = pd.read_parquet(run / "adjust" / "residuals.parquet")
    for sensor, number, most in (("laser", 1, 0.2), ("mbes", 2, 1.5)):  # mm; of the sonar biases are estimated beside
        rows = table[table["sensor"] == sensor]
        mine = read.user_data == number
        found = {(time, face): value for time, face, value in zip(
            np.round((read.gps_time[mine] + 1e9) * 1e6).astype(np.int64), read["face"][mine], read["residual_mm"][mine],
            strict=True)} if sensor == "laser" else {}  # fmt: skip
        assert mine.sum() >= len(rows)
        rms = [
            float(np.sqrt(np.mean(np.square(values))))
            for values in (read["residual_mm"][mine], rows["residual_m"] * 1e3)
        ]
        assert rms[0] == pytest.approx(rms[1], abs=most)
        times = np.round(rows["t_ns"].to_numpy() / 1e3).astype(np.int64)
        for time, face, residual in list(zip(times, rows["face"], rows["residual_m"], strict=True))[
            :: max(1, len(rows) // 50)
        ]:
            if (time, face) in found:
                assert found[time, face] == pytest.approx(residual * 1e3, abs=0.3)
    assert "points in pool" in told.out


def test_files_that_must_stay(undisturbed: tuple[Path, Told], place: Place) -> None:
    run, mine = undisturbed[0], place.folder / "mine.txt"
    mine.write_text("my notes\n")
    session = Path(yaml.safe_load((run / "run.yaml").read_text(encoding="utf-8"))["session_folder"])
    for file, said in (
        (mine, "is there, and poolcal did not write it"),
        (place.folder / "sheet.pdf", "name a file that ends in .txt"),
        (run / "sheet.txt", "lies in the folder"),
        (session / "sheet.txt", "lies in the folder"),
        (place.folder / "no" / "sheet.txt", f"there is no folder {place.folder / 'no'}; make it"),
        (place.folder / f"{'水' * 99}.txt", "cannot be written (File name too long)"),
    ):
        told = poolcal("export", run, "--to", "qinsy", "--out", file)
        assert (told.status, told.err.count("\n")) == (2, 1)
        assert said in told.err
    assert mine.read_text() == "my notes\n"
    sheet = place.folder / "sheet.txt"
    for name in ("qinsy", "qimera"):  # its own it replaces
        assert poolcal("export", run, "--to", name, "--out", sheet).status == 0
    assert "(qimera)" in sheet.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--to", "sonarwiz"), "--to sonarwiz: is no program known here; the programs are qinsy, qimera"),
        ((), "give RUN and --to NAME"),
        (("--to", "caris"), "--order: is needed"),
        (("--to", "qinsy", "--crs", "EPSG:32651"), "--crs: qinsy is a mount"),
        (("--to", "laz"), "name the file: --out FILE.laz"),
        (("--to", "laz", "--out", "a.laz", "--order", "YPR"), "of the options only --out, --crs"),
        (("--to", "laz", "--out", "a.laz", "--crs", "EPSG:4978"), "is no projected CRS"),
        (("--to", "pdal", "--projector-offset", 0, 0, 1), "this is the laser's mount"),
        (("--to", "qinsy", "--ins-point", "nan", 0, 0), "--ins-point nan: must be within"),
    ],
)
def test_bad_words(words: tuple[object, ...], said: str, undisturbed: tuple[Path, Told]) -> None:
    told = poolcal("export", undisturbed[0], *words)
    assert (told.status, told.err.count("\n"), told.out) == (2, 1, "")
    assert said in told.err


@pytest.mark.parametrize("change", ["roll", "matrix", "null", "covariance"])
def test_a_crafted_result_is_one_line(done: Place, change: str) -> None:
    path = done.run / "report" / "calibration.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    block = content["mbes"]
    if change == "roll":
        block["mount"]["roll_deg"] += 1.0
    elif change == "matrix":
        block["R_body_from_mbes"][0] = [1.0, 1.0, 1.0]
    elif change == "null":
        block["mount"] = None
    else:
        block["covariance_total"] = [[0.0]]
    path.write_text(json.dumps(content), encoding="utf-8")
    told = poolcal("export", done.run, "--to", "qinsy")
    assert (told.status, told.err.count("\n"), told.out) == (2, 1, "")


def test_list_and_files_that_are_no_text(place: Place, tmp_path: Path) -> None:
    assert poolcal("export", "--list").status == 0
    binary = tmp_path / "line.kmall"
    binary.write_bytes(b"\xff\xfe\x00#IIP")
    for words, said in (
        ((binary, "--from", "kongsberg"), "is not UTF-8"),
        ((tmp_path / "missing", "--from", "qinsy"), "cannot be read"),
        ((binary, "--from", "las"), "--from las: is no program known here"),
    ):
        told = poolcal("mount", *words, "--session", place.session)
        assert (told.status, told.err.count("\n")) == (2, 1)
        assert said in told.err


def test_a_sonar_mount_has_no_place_in_a_session_of_the_laser_alone(
    undisturbed: tuple[Path, Told], place: Place
) -> None:
    file = place.folder / "a.txt"
    assert poolcal("export", undisturbed[0], "--to", "qinsy", "--out", file).status == 0
    content = yaml.safe_load((place.session / "session.yaml").read_text(encoding="utf-8"))
    del content["mbes"]
    (place.session / "session.yaml").write_text(yaml.safe_dump(content, allow_unicode=True), encoding="utf-8")
    told = poolcal("mount", file, "--from", "qinsy", "--session", place.session)
    assert "mbes: is missing; add its block" in told.err
    edit(place.session / "session.yaml", "laser", mount_covariance=np.diag([1e-6] * 6).tolist())
    told = poolcal("mount", file, "--from", "qinsy", "--session", place.session, "--sensor", "laser")
    assert told.status == 0, told.err
    assert "Set laser.mount_sigma" in told.out
