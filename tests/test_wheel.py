"""What is installed works without the source tree: presets, scenarios and templates are in the wheel."""

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest
import yaml

from pipeline.errors import ConfigError
from pipeline.simulation.scenario import SCENARIOS_FOLDER, load_scenario
from tests.support.places import SMALL, result_of
from tests.support.roots import ROOT


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy: setuptools writes into the tree that it builds from."""
    source = tmp_path_factory.mktemp("source")
    for name in ("pipeline", "stages", "configs"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", source)
    (source / "configs" / "our_pool.yaml").write_text("target: {}\n")  # a crew's own, beside ours
    code = "import sys; from setuptools import build_meta; build_meta.build_wheel(sys.argv[1])"
    out = tmp_path_factory.mktemp("wheel")
    done = subprocess.run(
        [sys.executable, "-c", code, str(out)], cwd=source, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    (found,) = out.glob("*.whl")
    return found


def test_the_wheel_has_every_file_of_the_program(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as file:
        held = {name for name in file.namelist() if ".dist-info/" not in name}
    kinds = {"pipeline": "*", "stages": "*", "configs/instruments": "*.yaml", "configs/scenarios": "*.yaml"}
    paths = [path for folder, kind in kinds.items() for path in (ROOT / folder).rglob(kind)]
    paths += [ROOT / "configs" / name for name in ("defaults.yaml", "fleet.yaml", "marks.yaml")]
    ours = {
        path.relative_to(ROOT).as_posix() for path in paths if path.is_file() and "__pycache__" not in path.parts
    }
    assert held == ours
    assert len([name for name in held if name.startswith("configs/")]) > 10


def test_a_scenario_by_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert load_scenario(Path("dock")) == load_scenario(SCENARIOS_FOLDER / "dock.yaml")
    assert load_scenario(Path("dock")) != load_scenario(None)
    (tmp_path / "dock").write_text("name: mine\n")
    assert load_scenario(Path("dock")).name == "mine"
    for name in ("harbour", "../dock", "dock.yaml"):
        with pytest.raises(ConfigError, match=r"is neither a file|cannot be read") as told:
            load_scenario(Path(name))
        assert ("caisson, default, dock" in str(told.value)) == (name == "harbour")


@pytest.mark.thorough
def test_an_installed_wheel_simulates_and_calibrates_away_from_the_source(wheel: Path, tmp_path: Path) -> None:
    """A fresh environment that shares the libraries alone, in another folder, without PYTHONPATH."""
    place = tmp_path / "env"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(place)], check=True)
    python = place / "bin" / "python"
    install = ["-m", "pip", "--python", str(python), "install", "--no-deps", "--no-index", "-q", str(wheel)]
    subprocess.run([sys.executable, *install], check=True, capture_output=True)
    (site,) = place.glob("lib/python*/site-packages")
    (site / "libraries.pth").write_text(sysconfig.get_path("purelib") + "\n")  # their own .pth files are not read
    away = tmp_path / "away"
    away.mkdir()
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}

    def told(*words: object) -> str:
        done = subprocess.run(
            [*map(str, words)], cwd=away, env=environment, capture_output=True, text=True, timeout=600, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    where = told(python, "-c", "import pipeline, stages; print(pipeline.__file__, stages.__file__)").split()
    assert all(Path(one).is_relative_to(site) for one in where)
    poolcal = place / "bin" / "poolcal"
    assert "simulate" in told(poolcal, "--help")
    assert "small_target" in told(poolcal, "simulate", "--help")
    (away / "small.yaml").write_text(yaml.safe_dump(SMALL))
    told(poolcal, "simulate", "session", "--scenario", "small.yaml")
    content = yaml.safe_load((away / "session" / "session.yaml").read_text())
    names = {"ins": "novatel_span_lci", "laser": "riegl_vz1000", "mbes": "r2sonic_2024"}
    for sensor, name in names.items():
        content[sensor] = {key: content[sensor][key] for key in content[sensor] if key in ("files", "format", "mount")}
        content[sensor]["instrument"] = name
    (away / "session" / "session.yaml").write_text(yaml.safe_dump(content))
    command = (poolcal, "run", "session", "--config", "session/pool.yaml", "--run", "run", "--jobs", 2)
    assert "ACCEPTED" in told(*command)
    assert {sensor: one["name"] for sensor, one in result_of(away / "run")["instruments"].items()} == names
    assert (away / "run" / "report" / "report.html").stat().st_size > 100_000
    assert len(list((away / "run").glob("*/*.rrd"))) == 8
    assert "ACCEPTED" in told(*command)
    assert "everything is as recorded" in told(poolcal, "verify", "run")
    told(poolcal, "simulate", "by_name", "--scenario", "small_target")
