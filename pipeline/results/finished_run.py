"""A finished run, read from its folder to be compared with others."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.config.session import Calibrated
from pipeline.errors import ArtefactError
from pipeline.results.screen import summary
from pipeline.results.session_estimate import session_estimate
from pipeline.run import manifest
from pipeline.run.output_files import as_written
from pipeline.run.results import agreeing, calibration
from pipeline.run.settings import Settings, read_settings, refuse_other_sensor


@dataclass(frozen=True)
class FinishedRun:
    """A run folder's settings, calibration.json and manifests by stage."""

    path: Path
    settings: Settings
    result: Mapping[str, Any]
    manifests: Mapping[str, manifest.Manifest]

    @classmethod
    def read(cls, path: Path, stages: tuple[str, ...], calibrated: Calibrated = "mbes") -> "FinishedRun":
        """Return the run in a folder; raise ArtefactError unless all ``stages`` are complete and agree.

        Parameters
        ----------
        path
            The run folder.
        stages
            Names of the stages of such a run.
        calibrated
            The sensor that the run must calibrate.
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
        result = calibration(path)
        with as_written(path):
            if calibrated == "mbes":
                session_estimate(result)
            for name in ("inputs", "software"):
                manifest.flattened(result[name])
            summary(result)  # --rrd shows it
        return cls(path, read_settings(path), result, manifests)
