"""All tables and streams of the catalogue."""

from pipeline.artefacts.catalogue import patent, points, results, target
from pipeline.artefacts.schema import Artefact

ALL_ARTEFACTS: tuple[Artefact, ...] = tuple(
    value
    for module in (points, target, patent, results)
    for value in vars(module).values()
    if isinstance(value, Artefact)
)
