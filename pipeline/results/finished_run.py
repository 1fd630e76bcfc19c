"""A finished run, read from its folder to be compared with others."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipeline.config.session import Calibrated
from pipeline.errors import ArtefactError
from pipeline.report.reason_codes import WEAK_ALONE
from pipeline.results.screen import summary
from pipeline.results.session_estimate import session_estimate
from pipeline.run import manifest
from pipeline.run.freshness import OF_HEADS
from pipeline.run.output_files import as_written
from pipeline.run.results import Tables, agreeing, calibration
from pipeline.run.settings import Settings, read_settings, refuse_other_sensor


@dataclass(frozen=True)
class FinishedRun:
    """A run folder's settings, calibration.json and manifests by stage."""

    path: Path
    settings: Settings
    result: Mapping[str, Any]
    manifests: Mapping[str, manifest.Manifest]

    @classmethod
    def read(
        cls, path: Path, stages: tuple[str, ...], calibrated: Calibrated = "mbes", several_heads: bool = False
    ) -> "FinishedRun":
        """Return the run in a folder; raise ArtefactError unless all ``stages`` are complete and agree.

        Parameters
        ----------
        path
            The run folder.
        stages
            Names of the stages of such a run.
        calibrated
            The sensor that the run must calibrate.
        several_heads
            False: refuse the run of a sonar with several heads.
        """
        if not path.is_dir():
            raise ArtefactError(f"{path}: there is no such folder; name a run folder")
        refuse_other_sensor(path, calibrated)
        for stage in stages:
            if manifest.read_manifest(path / stage) is None:
                raise ArtefactError(f"{path}: {stage} has no complete result; run poolcal run again")
        manifests = agreeing(path, stages)
        for stage in stages:
            if stage not in manifests:
                raise ArtefactError(f"{path}: {stage} was made from other settings or results; run poolcal run again")
        result = calibration(path, several_heads)
        with as_written(path):
            run = cls(path, read_settings(path), result, manifests)
            if calibrated == "mbes":
                for head in run.heads:
                    session_estimate(run.of_head(head).result)
            for name in ("inputs", "software"):
                manifest.flattened(result[name])
            summary(result)  # --rrd shows it
        return run

    @property
    def heads(self) -> tuple[str, ...]:
        """Names of the sonar's heads, the first one first; of one head its name alone."""
        return tuple(str(block["name"]) for block in self.result.get("heads", ())) or ("mbes",)

    @property
    def grave_reasons(self) -> tuple[str, ...]:
        """Codes of the reasons that say that something is wrong, each once: not only that a sigma is too large."""
        return tuple(dict.fromkeys(code for code in self.result["reason_codes"] if code not in WEAK_ALONE))

    @property
    def tables(self) -> Tables:
        """The tables of the stages that the head has in a run of its own; of the first head, of this run."""
        head = self.result.get("head", "mbes")
        return Tables(self.path if head == "mbes" else self.path / OF_HEADS / str(head))

    def of_head(self, head: str) -> "FinishedRun":
        """Return the run as if the sonar had this head alone, with its blocks and settings in place of the first's."""
        if len(self.heads) == 1:
            return self
        (block,) = (block for block in self.result["heads"] if block["name"] == head)
        own = {key: block[key] for key in ("methods", "coarse", "systematic")}
        own |= {"mbes": block, "heads": [], "head": head}
        settings = replace(self.settings, session=self.settings.session.alone(head))
        return replace(self, settings=settings, result={**self.result, **own})
