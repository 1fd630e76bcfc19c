"""The stages, one module each, in the order in which they run."""

from importlib import import_module
from types import ModuleType

ORDER = ("ingest", "georeference", "segment", "fit_planes", "angle_iterate", "offsets", "adjust", "report")


def load() -> tuple[ModuleType, ...]:
    """The modules of ORDER; late, for they import numpy and pandas."""
    return tuple(import_module(f"stages.{name}") for name in ORDER)
