"""Toy stages with the shape of real ones: points are counted by pass, a plane is 'fitted', a verdict is written."""

import types
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd

from pipeline.artefacts.columns import F64, I16, I64, TEXT
from pipeline.artefacts.schema import Artefact, Column, Document, Provenance, RawFiles
from pipeline.artefacts.streams import EMPTY_STREAM, Batch, BatchResult, Chunk, Stream
from pipeline.config.pool import Ingest, Segment
from pipeline.config.session import Laser
from pipeline.config.verdict import VerdictLimits
from pipeline.errors import RawDataError

POINTS = Artefact(
    "take", "points", "stream", "points", (Column("t_ns", I64, "ns", "time"), Column("x_m", F64, "m", "x"))
)
TAKE_COUNTS = Artefact(
    "take", "counts", "table", "counts",
    (Column("source", TEXT, "", "s"), Column("reason", TEXT, "", "r"), Column("count", I64, "1", "n")),
)
NEAR = Artefact(
    "sift", "near", "stream", "points kept",
    (Column("t_ns", I64, "ns", "time"), Column("face", I16, "1", "face"), Column("x_m", F64, "m", "x")),
)
MEANS = Artefact("sift", "means", "table", "means", (Column("face", I16, "1", "face"), Column("mean_m", F64, "m", "x")))
TEXT_OUT = Document("tell", "calibration.json")


@dataclass(frozen=True)
class RawPart:
    """A raw file of float64 numbers, read ``step`` numbers at a time."""

    path: Path
    step: int = 1000

    @property
    def name(self) -> str:
        return self.path.name

    def chunks(self) -> Iterator[Chunk]:
        x_m = np.fromfile(self.path)
        for start in range(0, len(x_m), self.step):
            piece = x_m[start : start + self.step]
            yield Chunk({"t_ns": np.arange(start, start + len(piece)), "x_m": piece}, {"bad": 1})


def raw_files(settings: Any, folder: Path) -> list[Path]:
    return sorted(path for pattern in settings.files for path in folder.glob(pattern))


def raw_parts(sensor: str, settings: Any, folder: Path) -> tuple[RawPart, ...]:
    return tuple(RawPart(path) for path in raw_files(settings, folder))


# --- take: raw files -> a stream -------------------------------------------------------------------------------------
@dataclass(frozen=True)
class TakeConfig:
    laser: Laser
    ingest: Ingest


@dataclass(frozen=True)
class TakeInputs:
    laser: Annotated[Stream, RawFiles("laser")]


@dataclass(frozen=True)
class TakeOutputs:
    counts: Annotated[pd.DataFrame, TAKE_COUNTS]
    points: Annotated[Stream, POINTS] = EMPTY_STREAM


def _take_batch(source: str, chunk: Chunk, prepared: None, config: TakeConfig) -> BatchResult:
    return BatchResult({"points": chunk.columns}, len(chunk.columns["t_ns"]))


def _take_combine(prepared: None, partials: dict[str, list[tuple[str, int]]], config: TakeConfig) -> TakeOutputs:
    count = sum(number for _, number in partials["laser"])
    return TakeOutputs(pd.DataFrame({"source": ["laser"], "reason": ["used"], "count": [count]}))


# --- sift: a stream -> a stream and a table --------------------------------------------------------------------------
@dataclass(frozen=True)
class SiftConfig:
    segment: Segment


@dataclass(frozen=True)
class SiftInputs:
    points: Annotated[Stream, POINTS]


@dataclass(frozen=True)
class SiftOutputs:
    means: Annotated[pd.DataFrame, MEANS]
    near: Annotated[Stream, NEAR] = EMPTY_STREAM


def _sift_prepare(inputs: SiftInputs, config: SiftConfig) -> float:
    return max(inputs.points.fold(_largest), default=0.0)


def _largest(batch: Batch) -> float:
    return float(np.max(batch["x_m"]))


def _sift_batch(source: str, chunk: Chunk, prepared: float, config: SiftConfig) -> BatchResult:
    x_m = chunk.columns["x_m"]
    keep = np.abs(x_m) > config.segment.margin_m
    near = {"t_ns": chunk.columns["t_ns"][keep], "face": np.zeros(keep.sum(), np.int64), "x_m": x_m[keep] / prepared}
    return BatchResult({"near": near}, (float(x_m[keep].sum()), int(keep.sum())))


def refuse(source: str, chunk: Chunk, prepared: float, config: SiftConfig) -> BatchResult:
    raise RawDataError("laser/0.bin: cannot be used; take another")


def _sift_combine(
    prepared: float, partials: dict[str, list[tuple[str, tuple[float, int]]]], config: SiftConfig
) -> SiftOutputs:
    total = sum(value for _, (value, _) in partials["points"])
    count = sum(number for _, (_, number) in partials["points"])
    return SiftOutputs(pd.DataFrame({"face": [0], "mean_m": [round(total / max(count, 1), 3)]}))


# --- tell: a table -> a document -------------------------------------------------------------------------------------
@dataclass(frozen=True)
class TellConfig:
    verdict: VerdictLimits
    name: str


@dataclass(frozen=True)
class TellInputs:
    means: Annotated[pd.DataFrame, MEANS]
    provenance: Annotated[dict[str, Any], Provenance]


@dataclass(frozen=True)
class TellOutputs:
    calibration_json: Annotated[str, TEXT_OUT]


def _tell_run(inputs: TellInputs, config: TellConfig) -> TellOutputs:
    return TellOutputs(f'{{"session": "{config.name}", "mean": {inputs.means["mean_m"][0]}}}\n')


def _module(name: str, **content: Any) -> types.ModuleType:
    module = types.ModuleType(f"toystages.{name}")
    module.__file__ = __file__
    vars(module).update(content)
    return module


def stages() -> tuple[types.ModuleType, ...]:
    """Fresh modules, so that a test may change one."""
    return (
        _module("take", Config=TakeConfig, Inputs=TakeInputs, Outputs=TakeOutputs,
                prepare=lambda inputs, config: None, run_batch=_take_batch, combine=_take_combine),
        _module("sift", Config=SiftConfig, Inputs=SiftInputs, Outputs=SiftOutputs,
                prepare=_sift_prepare, run_batch=_sift_batch, combine=_sift_combine),
        _module("tell", Config=TellConfig, Inputs=TellInputs, Outputs=TellOutputs, run=_tell_run),
    )
