"""Types that describe tables, streams and documents. :mod:`pipeline.artefacts.catalogue` has all descriptions."""

from dataclasses import dataclass
from typing import Literal

import pyarrow as pa


@dataclass(frozen=True)
class Column:
    """A column of a table or stream; unit and meaning are stored in the Parquet schema."""

    name: str
    type: pa.DataType
    unit: str
    meaning: str


@dataclass(frozen=True)
class Artefact:
    """A table or stream, and the stage (owner) that writes it."""

    owner: str
    name: str
    kind: Literal["table", "stream"]
    meaning: str
    columns: tuple[Column, ...]

    @property
    def schema(self) -> pa.Schema:
        """The Parquet schema, with unit and meaning in each field's metadata."""
        return pa.schema(
            [
                pa.field(c.name, c.type, metadata={"unit": c.unit, "meaning": c.meaning})
                for c in self.columns
            ],
            metadata={"artefact": f"{self.owner}/{self.name}", "meaning": self.meaning},
        )


@dataclass(frozen=True)
class RawFiles:
    """A stage input that is not a table of an earlier stage: the raw files of one sensor."""

    sensor: Literal["ins", "laser", "mbes"]


@dataclass(frozen=True)
class OfFurtherHeads:
    """A stage input: a table or stream of each further head of the sonar, by the head's name.

    Each of these heads has a run of its own in the run folder, as if the session had no other.
    """

    artefact: Artefact


@dataclass(frozen=True)
class Document:
    """A stage output that is not a table: a text file for other programs or people."""

    owner: str
    name: str


@dataclass(frozen=True)
class Provenance:
    """A stage input: digests of the raw files, and versions of the software."""
