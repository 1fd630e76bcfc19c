"""The stages, one module for each, in the order in which they run."""

from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipeline.config.session import Calibrated

ORDER = ("ingest", "georeference", "segment", "fit_planes", "angle_iterate", "offsets", "adjust", "report")
LASER = ("ingest", "georeference", "segment", "fit_planes", "adjust", "report")  # to calibrate the laser


def load(calibrated: "Calibrated" = "mbes") -> tuple[ModuleType, ...]:
    """Import and return the modules of ORDER or of LASER. Before this call numpy and pandas are not imported."""
    return tuple(import_module(f"stages.{name}") for name in (ORDER if calibrated == "mbes" else LASER))


def names_in(run: Path) -> tuple[str, ...]:
    """Return the names of a run folder's stages; ORDER if ``run`` is no run folder."""
    from pipeline.run.settings import calibrated_in, holds_run

    of_laser = holds_run(run) and calibrated_in(run) == "laser"
    return LASER if of_laser else ORDER
