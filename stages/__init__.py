"""The stages, one module each, in the order in which they run."""

from importlib import import_module
from types import ModuleType
from typing import Literal

ORDER = ("ingest", "georeference", "segment", "fit_planes", "angle_iterate", "offsets", "adjust", "report")
LASER = ("ingest", "georeference", "segment", "fit_planes", "laser.adjust", "laser.report")  # calibrates the laser


def load(calibrated: Literal["mbes", "laser"] = "mbes") -> tuple[ModuleType, ...]:
    """The modules of ORDER, or of LASER; late, for they import numpy and pandas."""
    return tuple(import_module(f"stages.{name}") for name in (ORDER if calibrated == "mbes" else LASER))
