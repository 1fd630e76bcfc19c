"""A run folder of toy stages."""

from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

from pipeline.run import runner
from pipeline.run.progress import Progress
from pipeline.run.workers import SERIAL, Workers
from tests.support import toys

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
        progress.note = self.said.append  # type: ignore[assignment,method-assign]  # kept in a list, not printed
        return runner.run(self.stages, self.session, self.config, self.run_folder, workers=workers, progress=progress)
