"""Every table that a stage writes: owner, name, columns, units.

These modules, two stages each, are the only place that names a column. ``schema`` carries unit and meaning in each
Parquet field's metadata, so a file explains itself. Kinds: a *table* fits in memory; a *stream* is a folder of parts
(see :mod:`pipeline.streams`).
"""

# Whatever these modules name is here by that name.
# ruff: noqa: F403
from pipeline.artefacts.patent import *
from pipeline.artefacts.points import *
from pipeline.artefacts.results import *
from pipeline.artefacts.target import *
from pipeline.columns import Artefact as Artefact
from pipeline.columns import Column as Column
from pipeline.columns import Document as Document
from pipeline.columns import Provenance as Provenance
from pipeline.columns import Raw as Raw

ALL: tuple[Artefact, ...] = tuple(value for value in list(globals().values()) if isinstance(value, Artefact))
