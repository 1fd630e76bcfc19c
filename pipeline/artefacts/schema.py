"""What a table, a stream and a document are; their catalogue is :mod:`pipeline.artefacts`."""

from dataclasses import dataclass
from typing import Literal

import pyarrow as pa


@dataclass(frozen=True)
class Column:
    name: str
    type: pa.DataType
    unit: str
    meaning: str


@dataclass(frozen=True)
class Artefact:
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
class Document:
    """A stage output that is not a table: a text file for other programs or people."""

    owner: str
    name: str


@dataclass(frozen=True)
class Provenance:
    """A stage input that says what the run is made from: digests of the raw files, and versions of the software."""
