"""A session folder of toy raw files, and a pool's config."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from pipeline.run import runner
from pipeline.run.progress import Progress
from pipeline.run.workers import SERIAL, Workers
from tests.runner import toys

SESSION = """
name: toy
ins: {files: [ins/*], format: table}
laser: {files: [laser/*], format: table, mount: MOUNT}
mbes: {files: [mbes/*], format: table, mount: MOUNT}
"""
MOUNT = "{roll_deg: 0, pitch_deg: 0, yaw_deg: 0, x_m: 0, y_m: 0, z_m: 0}"
POOL = """
target: {a: 8.0, b: 3.0, c: 1.0, e: 0.5, origin: {latitude_deg: 45, longitude_deg: 126, height_m: 100}}
segment: {margin_m: MARGIN}
"""


@dataclass
class Pool:
    """Two files to calibrate from, and where the result goes."""

    session: Path
    config: Path
    run_folder: Path
    stages: tuple[ModuleType, ...] = field(default_factory=toys.stages)
    said: list[str] = field(default_factory=list)

    def margin(self, margin_m: float) -> None:
        self.config.write_text(POOL.replace("MARGIN", str(margin_m)), encoding="utf-8")

    def run(self, workers: Workers = SERIAL) -> list[str]:
        """The stages that were run; what was said about them is kept in ``said``."""
        progress = Progress()
        self.said.clear()
        progress.note = self.said.append  # type: ignore[method-assign]
        return runner.run(self.stages, self.session, self.config, self.run_folder, workers, progress)


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
