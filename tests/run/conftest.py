"""A session folder of toy raw files, and a pool's config."""

import json
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tests.support import toys
from tests.support.toy_run import MOUNT, SESSION, Pool


@pytest.fixture
def pool(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Pool:
    monkeypatch.setattr("pipeline.readers.dispatch.raw_files", toys.raw_files, raising=False)
    monkeypatch.setattr("pipeline.readers.dispatch.raw_parts", toys.raw_parts, raising=False)
    session = tmp_path / "session"
    rng = np.random.default_rng(1)
    for sensor, names in {"laser": ("0.bin", "1.bin"), "ins": ("0.bin",), "mbes": ("0.bin",)}.items():
        (session / sensor).mkdir(parents=True)
        for name in names:
            rng.normal(size=5000).tofile(session / sensor / name)
    (session / "session.yaml").write_text(SESSION.replace("MOUNT", MOUNT), encoding="utf-8")
    made = Pool(session, tmp_path / "pool.yaml", tmp_path / "runs" / "a")
    made.margin(0.05)
    return made


@pytest.fixture
def contents() -> Callable[[Path], dict[str, bytes]]:
    """Every file in a folder that must be the same in two runs of the same input."""

    def read(folder: Path) -> dict[str, bytes]:
        paths = [p for p in folder.rglob("*") if p.is_file() and p.parent != folder and p.name != "manifest.json"]
        return {p.relative_to(folder).as_posix(): p.read_bytes() for p in paths}

    return read


def _verdict(inputs: Any, config: Any) -> toys.TellOutputs:
    """Accepted up to a sigma of 1 m; the mean makes one result differ from another."""
    verdict = "accepted" if (config.verdict.max_sigma_m or 0.0) <= 1 else "rejected"
    found = {"verdict": verdict, "mean": float(inputs.means["mean_m"][0]), "limit": config.verdict.max_sigma_m}
    return toys.TellOutputs(json.dumps(found))


@pytest.fixture
def stages() -> tuple[ModuleType, ...]:
    made = toys.stages()
    made[2].run = _verdict
    return made


@pytest.fixture
def judged(pool: Pool, stages: tuple[ModuleType, ...]) -> Pool:
    """Accepted, with a page."""
    pool.stages = stages
    pool.run()
    (pool.run_folder / "tell" / "report.html").write_text("<p>first</p>")
    (pool.run_folder / "tell" / "calibration.yaml").write_text("first: 1\n")
    return pool
