"""A session whose cast is a file: the same as one with the cast's list, and out of date when the file changes."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from tests.support.places import Place, Told, digests, poolcal

DEPTHS = np.round(np.arange(0.1, 4.0, 0.02), 2)
SPEEDS = np.round(1500.0 + 0.02 * DEPTHS**2, 3)


def give(place: Place, speeds: np.ndarray = SPEEDS, day: str = "2026-132") -> Path:
    """A CARIS cast of 12 May 2026, the session's day, up to hundredths of a metre a second."""
    rows = "".join(f"{depth:.2f} {speed:.3f}\n" for depth, speed in zip(DEPTHS, speeds, strict=True))
    path = place.session / "cast.svp"
    path.write_text(f"[SVP_VERSION_2]\ncast.svp\nSection {day} 05:00:00 36:00:00 120:06:00\n{rows}")
    place.edit_session("mbes", svp="cast.svp")
    return path


@pytest.fixture(scope="module")
def template(small: Path, undisturbed: tuple[Path, Told], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run folder of a complete run, with the cast. Nobody changes it."""
    place = Place(small, tmp_path_factory.mktemp("traced"))
    place.mend()
    shutil.copytree(undisturbed[0], place.run)
    give(place)
    told = place.calibrate()
    assert told.ran[0] == "georeference", "the raw files are not read again for a cast"
    return place.run


@pytest.fixture
def traced(place: Place, template: Path) -> Place:
    give(place)
    shutil.copytree(template, place.run)
    return place


def test_a_cast_from_its_file(traced: Place, template: Path) -> None:
    """The result names the cast; a list of the same depths gives the same numbers; a changed file is noticed."""
    result, path = traced.result(), traced.session / "cast.svp"
    used = yaml.safe_load((traced.run / "run.yaml").read_text())["session"]["mbes"]
    assert result["cast"] | {"depths": 0, "sigma_m_s": 0.0} == used["svp_from"] | {"depths": 0, "sigma_m_s": 0.0}
    assert result["cast"]["depths"] == len(used["svp"])
    assert result["cast"]["rows"] == len(DEPTHS)
    assert result["inputs"]["cast.svp"] == result["cast"]["sha256"]
    for words in ("cast.svp", "CARIS .svp", "taken 2026-05-12 05:00:00", f"{len(DEPTHS)} rows", "0.1 to 3.98 m"):
        assert words in result["ranges"]
    depths, speeds = np.array(used["svp"]).T
    assert np.max(np.abs(np.interp(DEPTHS, depths, speeds) - SPEEDS)) <= 0.02
    assert not any("mbes.svp" in words for words in result["warnings"])
    assert traced.calibrate().ran == []
    assert poolcal("verify", traced.run).status == 0

    before = digests(traced.run)
    traced.edit_session("mbes", svp=used["svp"])
    traced.calibrate()
    for name, digest in digests(traced.run).items():
        assert digest == before[name], name
    give(traced)
    shutil.rmtree(traced.run)
    shutil.copytree(template, traced.run)
    assert traced.calibrate().ran == []

    path.write_text(path.read_text().replace("1500.001", "1500.101"))
    told = poolcal("verify", traced.run)
    assert told.status != 0
    assert "cast.svp: is not the cast that this run was made with; run poolcal run again" in told.out + told.err
    told = poolcal("stage", "adjust", traced.run)
    assert told.status == 2
    assert "cast.svp: is not the cast that this run was made with" in told.err
    words = ("--session", traced.session, "--config", traced.config, "--jobs", 1)
    assert poolcal("stage", "georeference", traced.run, *words).ran == ["georeference"]
    path.unlink()
    (line,) = traced.calibrate().complaints
    assert "mbes.svp: 'cast.svp' matches no file" in line


def test_a_casts_own_error_goes_into_the_total(traced: Place) -> None:
    """Half as sure of its speeds: the gradient's sigma is twice as large, and its effect grows."""
    small = _gradient(traced)
    traced.edit_session("mbes", svp_sigma_m_s=0.1, sound_speed_gradient_sigma_1_s=0.0)
    assert "adjust" in traced.calibrate().ran
    large = _gradient(traced)
    depth_m, span_m = 4.0, 3.98 - 0.1  # of the target's lower end, and what the cast covers of it
    assert large["considered"] == pytest.approx(np.sqrt(2) * 0.1 / span_m, rel=1e-6)
    missing = 1 - span_m / depth_m
    assert small["considered"] == pytest.approx(np.hypot(np.sqrt(2) * 0.05 / span_m, missing * 0.1), rel=1e-6)
    assert abs(large["effect_rotation_y"]) > 1.5 * abs(small["effect_rotation_y"]) > 0.0


def _gradient(place: Place) -> dict[str, float]:
    """Row of the single-parameter test of the sound speed's gradient."""
    table = pd.read_parquet(place.run / "adjust" / "freed.parquet").set_index("unknown")
    return table.loc["sound_speed_gradient"].to_dict()


def test_a_cast_of_another_day_is_named(done: Place) -> None:
    """In the report, where the file's name keeps its letters, and by check."""
    give(done, day="2026-129").rename(done.session / "Cast <b>1.SVP")
    done.edit_session("mbes", svp="*.SVP")
    done.calibrate("--report")
    page = (done.run / "report" / "report.html").read_text(encoding="utf-8")
    assert "Cast &lt;b&gt;1.SVP, CARIS .svp, taken 2026-05-09 05:00:00" in page
    assert "<b>1.SVP" not in page
    assert "sound speed as in the cast." in " ".join(page.split())
    assert any("1.SVP was taken at 2026-05-09 05:00:00, " in words for words in done.result()["warnings"])
    told = poolcal("check", done.session)
    assert told.out.startswith("mbes.svp: Cast <b>1.SVP, CARIS .svp, taken 2026-05-09 05:00:00: 195 rows; 0.1")
    told = poolcal("check", done.session, "--config", done.config, "--json")
    words = [finding["words"] for finding in json.loads(told.out)["findings"]]
    assert any("1.SVP was taken at 2026-05-09" in one for one in words)
    assert not any("km from here" in one for one in words)


def test_a_bad_cast_is_one_line(done: Place) -> None:
    path = give(done)
    path.write_text("Depth (m),Temperature (C)\n1,20\n")
    told = done.calibrate()
    assert told.status == 2
    (line,) = told.complaints
    assert "cast.svp: has temperature, conductivity or salinity, and no sound speed with a depth; export depth" in line
