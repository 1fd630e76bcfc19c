"""A session, its config and a run folder; the command line called on them; what a run must have left behind."""

import contextlib
import hashlib
import io
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from stages import ORDER
from stages.cli import call
from tests.support.mount_errors import mount_error
from tests.support.roots import ROOT

POOLCAL = [sys.executable, "-m", "stages.cli"]
SMALL: dict[str, Any] = {  # two passes, thinned: a run takes about two seconds
    "name": "small",
    "track": {"distances_m": [4.0, 7.0], "half_length_m": 3.6},
    "laser": {"point_rate_hz": 2000.0, "line_rate_hz": 20.0, "format": "las"},
    "mbes": {"ping_rate_hz": 8.0},
    "ins": {"rate_hz": 50.0},
}


@dataclass(frozen=True)
class Told:
    """What a command ended with."""

    status: int
    out: str
    err: str

    @property
    def complaints(self) -> list[str]:
        """Lines on standard error that are not of a stage's progress, each of which begins with the stage's name."""
        progress = tuple(f"{name}: " for name in ORDER)
        return [line for line in self.err.splitlines() if not line.startswith(progress)]

    @property
    def ran(self) -> list[str]:
        return [name for name in ORDER if f"\n{name}: done in" in f"\n{self.err}"]


def poolcal(*words: object) -> Told:
    """The command line in this process; pictures only where they are asked for."""
    if words[0] in ("run", "stage"):
        for what in ("report", "recordings"):
            if not {f"--{what}", f"--no-{what}"} & set(words):
                words = (words[0], f"--no-{what}", *words[1:])
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = call([str(word) for word in words])
    return Told(status, out.getvalue(), err.getvalue())


def poolcal_process(*words: object, **environment: str) -> Told:
    """The command line as its own process."""
    command = [*POOLCAL, *map(str, words)]
    done = subprocess.run(
        command, cwd=ROOT, env=os.environ | environment, capture_output=True, text=True, timeout=120, check=False
    )
    return Told(done.returncode, done.stdout, done.stderr)


@dataclass(frozen=True)
class Place:
    """A session of one's own to spoil, mend and calibrate."""

    template: Path
    folder: Path

    @property
    def session(self) -> Path:
        return self.folder / "session"

    @property
    def config(self) -> Path:
        return self.folder / "pool.yaml"

    @property
    def run(self) -> Path:
        return self.folder / "runs" / "a"

    def mend(self) -> None:
        """Session and config as they were simulated."""
        shutil.rmtree(self.session, ignore_errors=True)
        shutil.copytree(self.template, self.session)
        shutil.copy(self.template / "pool.yaml", self.config)

    def words(self) -> tuple[object, ...]:
        return ("run", self.session, "--config", self.config, "--run", self.run, "--jobs", 1)

    def calibrate(self, *more: object) -> Told:
        return poolcal(*self.words(), *more)

    def edit_session(self, sensor: str, **values: Any) -> None:
        edit(self.session / "session.yaml", sensor, **values)

    def edit_config(self, block: str, **values: Any) -> None:
        edit(self.config, block, **values)

    def result(self) -> dict[str, Any]:
        return result_of(self.run)

    def raw(self, sensor: str) -> Path:
        """The first raw file of a sensor."""
        return sorted((self.session / sensor).iterdir())[0]


def edit(path: Path, block: str, **values: Any) -> None:
    """Set keys of one block (or, with block "", of the file)."""
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    inside = content.setdefault(block, {}) if block else content
    for name, value in values.items():
        if isinstance(value, dict) and isinstance(inside.get(name), dict):
            inside[name] |= value
        else:
            inside[name] = value
    path.write_text(yaml.safe_dump(content, sort_keys=False, allow_unicode=True), encoding="utf-8")


def simulate(folder: Path, seed: int = 1, base: Path | None = None, **blocks: Any) -> Path:
    """A session folder of the small scenario with some blocks changed."""
    scenario = yaml.safe_load((base).read_text(encoding="utf-8")) if base else {}
    for settings in (SMALL, blocks):
        for name, values in settings.items():
            scenario[name] = scenario.get(name, {}) | values if isinstance(values, dict) else values
    folder.parent.mkdir(parents=True, exist_ok=True)
    path = folder.with_name(folder.name + ".scenario.yaml")
    path.write_text(yaml.safe_dump(scenario, allow_unicode=True), encoding="utf-8")
    told = poolcal("simulate", folder, "--scenario", path, "--seed", seed)
    assert told.status == 0, told.err
    return folder


def result_of(run: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((run / "report" / "calibration.json").read_text(encoding="utf-8"))
    return content


def digests(run: Path) -> dict[str, str]:
    """SHA-256 of every Parquet file of a run, by its path in the run folder."""
    found = {}
    for path in sorted(run.rglob("*.parquet")):
        found[path.relative_to(run).as_posix()] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def errors(block: dict[str, Any], truth: dict[str, Any]) -> np.ndarray:
    """True minus found: rotation vector in degrees about the body's axes, lever arm in metres."""
    return np.asarray(mount_error(block, truth) * np.repeat([np.degrees(1.0), 1.0], 3))


def sigmas(block: dict[str, Any]) -> np.ndarray:
    return np.array([*block["sigma"]["rotation_vector_deg"], *block["sigma"]["lever_arm_m"]])
