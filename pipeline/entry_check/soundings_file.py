"""The soundings of a file near the run's track, in the pool frame: text, LAS, LAZ or GSF, read batch by batch."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import BATCH_ROWS
from pipeline.entry_check.fingerprints import FilePoints
from pipeline.entry_check.placing import GEOGRAPHIC, Placing, guessed, hints, placing_of
from pipeline.entry_check.run_soundings import RunSide
from pipeline.errors import RawDataError
from pipeline.readers.crs import DEGREE_M
from pipeline.readers.detect import kind_of
from pipeline.readers.exported import text_layout, text_points
from pipeline.readers.file_kind import GSF, LAS
from pipeline.readers.gsf_places import POSITION_STEP_M, gsf_points
from pipeline.readers.las import crs_of_las, las_points
from pipeline.readers.las_header import read_header
from pipeline.readers.laz import decompressed_points
from pipeline.readers.raw_file import opened

Array = NDArray[np.float64]
Batches = Iterator[tuple[Array, int]]

MOST_POINTS = 600_000  # of the file, near the track; beyond, every other block of rows is left out
BLOCK_ROWS = 512
MARGIN_M = 10.0  # by how much a lever arm may be wrong
LEAST_POINTS = 60
SOFTWARE = slice(58, 90)  # bytes of a LAS file with its generating software
COARSEST_M = 0.1
GRID_STEP_M, GRID_ROUNDING = 0.04, 0.1  # least cell of a grid; of multiples of the cell, as a share of it


@dataclass(frozen=True)
class Source:
    """A file's rows, and what it says of its CRS.

    Attributes
    ----------
    batches
        Coordinates (n, 3) as they stand, heights up; number of rows left out.
    declared
        The CRS that it declares; empty: none.
    geographic
        Whether its columns are named longitude and latitude; None: they have no names.
    step_m
        Rounding of places that the coordinates do not show.
    depths
        Whether its heights are depths below the water, from which a place has no height.
    """

    batches: Batches
    declared: str = ""
    geographic: bool | None = None
    step_m: float = 0.0
    depths: bool = False


@dataclass(frozen=True)
class FileSide:
    """The file's points near the track.

    Attributes
    ----------
    points
        The points.
    placing
        How its coordinates were read.
    near, rows, lost
        Number of rows near the track, of which not all may be taken; of rows with three numbers, and without.
    depths
        Whether its heights are depths below the water.
    cell_m
        Cell of a grid in which the points stand; None: they stand in none.
    """

    points: FilePoints
    placing: Placing
    near: int
    rows: int
    lost: int
    depths: bool
    cell_m: float | None


def opened_source(path: Path) -> Source:
    """Return a file's rows; raise RawDataError if it is none of the forms that are read."""
    kind = kind_of(path, str(path))
    if kind is GSF:
        return Source(gsf_points(path), GEOGRAPHIC, True, POSITION_STEP_M, depths=True)
    if kind is LAS:
        if _is_written_here(path):
            raise RawDataError(
                f"{path}: is a cloud of poolcal export, which proves nothing of another program; export the soundings "
                "from that program"
            )
        return Source(_las(path), crs_of_las(path, str(path)))
    layout = text_layout(path)
    return Source(text_points(path, layout), geographic=layout.geographic, depths=layout.depths)


def _is_written_here(path: Path) -> bool:
    """Whether a LAS file names poolcal as the generating software."""
    with opened(path, str(path)) as file:
        return file.read(SOFTWARE.stop)[SOFTWARE].startswith(b"poolcal ")


def _las(path: Path) -> Batches:
    header = read_header(path, str(path), timed=False)
    with opened(path, str(path)) as file:
        if header.compressed:
            batches = decompressed_points(path, str(path), 0, header.present, BATCH_ROWS)
        else:
            batches = las_points(file, str(path), 0, header.present)
        for points in batches:
            yield np.stack(points.places(slice(None)), axis=1), 0


def file_side(path: Path, crs: str | None, side: RunSide) -> FileSide:
    """Return the file's points near the track.

    Parameters
    ----------
    path
        The file.
    crs
        The CRS of its coordinates by the user; None: the one that it declares, or else the one that fits.
    side
        The run.
    """
    source = opened_source(path)
    near, rows, lost, first = _Near(side), 0, 0, np.empty((0, 3))
    placing: Placing | None = None
    for coordinates, left_out in source.batches:
        if placing is None and len(coordinates):
            placing, first = _placing(path, crs or source.declared, coordinates, side, source.geographic), coordinates
        if placing is not None:
            near.add(placing.in_pool(coordinates, side.frame), rows)
        rows, lost = rows + len(coordinates), lost + left_out
    if placing is None:
        raise RawDataError(f"{path}: holds no sounding; export x, y, z of each sounding")
    points, row = near.points()
    if len(points) < LEAST_POINTS:
        raise RawDataError(_elsewhere(path, placing, first, (len(points), rows), side))
    step_m = max(source.step_m, _step_m(first, placing))
    if step_m > COARSEST_M * 1.01:
        raise RawDataError(f"{path}: its coordinates are whole steps of {step_m:.2g} m; export 3 decimals of a metre")
    taken = FilePoints(points, row, step_m / 2)
    return FileSide(taken, placing, near.seen, rows, lost, source.depths, _cell_m(first, placing))


def _placing(path: Path, crs: str, coordinates: Array, side: RunSide, geographic: bool | None) -> Placing:
    if not crs:
        placing = guessed(coordinates, side, geographic)
        if placing is None:
            shown = ", ".join(f"{value:.3f}" for value in coordinates[0])
            likely = [one.name for one in hints(coordinates, side, 2000.0)]
            hint = f"; they would fit {' or '.join(dict.fromkeys(likely))}" if likely else ""
            raise RawDataError(
                f"{path}: nothing says in which CRS its coordinates are ({shown}), and they lie near the target "
                f"neither as degrees, UTM nor ECEF{hint}; name the CRS with --crs"
            )
        return placing
    placing = placing_of(crs, side)
    other = replace(placing, swapped=True)
    away, away_other = (_nearest_m(one, coordinates, side) for one in (placing, other))
    return other if away_other < away and away_other < side.soundings.reach_m + MARGIN_M else placing


def _nearest_m(placing: Placing, coordinates: Array, side: RunSide) -> float:
    """Return the horizontal distance from the target of the nearest point."""
    level = placing.in_pool(coordinates, side.frame)[:, :2]
    return float(np.min(np.linalg.norm(level, axis=1), initial=np.inf, where=np.isfinite(level).all(axis=1)))


def _elsewhere(path: Path, placing: Placing, coordinates: Array, counts: tuple[int, int], side: RunSide) -> str:
    """Return the message that the points lie elsewhere, and in which CRS they would lie at the target.

    ``coordinates`` are the file's first; ``counts`` are the numbers of those near the track and of all.
    """
    count, rows = counts
    away = _nearest_m(placing, coordinates, side)
    if away < side.soundings.reach_m + MARGIN_M:
        return (
            f"{path}: too few soundings lie near the run's track ({count}; {LEAST_POINTS} are needed); "
            "export whole passes"
        )
    says = (
        f"{path}: in {placing.name} ({placing.title}) {count:,} of {rows:,} soundings lie near the run's track"
    )
    found = hints(coordinates, side, 500.0)
    if found:
        names = [f"{one.name} ({one.title}{', x and y exchanged' if one.swapped else ''})" for one in found]
        return f"{says}; they would in {' or '.join(names)}: name that with --crs"
    where = f"the nearest is {away:,.0f} m from the target" if np.isfinite(away) else "they lie nowhere on the earth"
    return f"{says}: {where}; is it another datum, another CRS, or another session?"


def _step_m(coordinates: Array, placing: Placing) -> float:
    """Return the step of the coordinates, m: the largest power of ten of which they are whole multiples."""
    steps = []
    for values, unit_m in zip(
        coordinates.T, (DEGREE_M,) * 2 + (1.0,) if placing.geographic else (1.0,) * 3, strict=True
    ):
        some = values[:: max(1, len(values) // 1000)]
        float_error = 4 * np.finfo(np.float64).eps * np.abs(some)
        decimals = next(
            (d for d in range(12) if np.all(np.abs(some - np.round(some, d)) <= 1e-9 * 10.0**-d + float_error)), 12
        )
        steps.append(10.0**-decimals * unit_m)
    return max(steps)


def _cell_m(coordinates: Array, placing: Placing) -> float | None:
    """Return the least step between different coordinates, m, if all steps are whole multiples of it; else None."""
    cells = []
    for values in coordinates[:, :2].T:
        steps = np.diff(np.unique(values))
        steps = steps[steps > 1e-9 * max(float(np.abs(values).max()), 1.0)]
        if not len(steps) or np.abs(steps / steps.min() - np.round(steps / steps.min())).max() > GRID_ROUNDING:
            return None
        cells.append(float(steps.min()) * (DEGREE_M if placing.geographic else 1.0))
    return min(cells) if min(cells) >= GRID_STEP_M else None


class _Near:
    """Points within reach of the track, horizontally: heights may be above another surface. Their number is bounded."""

    def __init__(self, side: RunSide) -> None:
        track = side.soundings.positions_m[:, :2]
        reach = side.soundings.reach_m + MARGIN_M
        self.low, self.high, self.frame = track.min(axis=0) - reach, track.max(axis=0) + reach, side.frame
        self.kept: list[tuple[Array, NDArray[np.int64]]] = []
        self.every, self.count, self.seen = 1, 0, 0

    def add(self, points: Array, first_row: int) -> None:
        """Add points (n, 3), the file's from row ``first_row`` on."""
        with np.errstate(invalid="ignore"):
            good = ((points[:, :2] > self.low) & (points[:, :2] < self.high)).all(axis=1) & np.isfinite(points[:, 2])
        row = first_row + np.flatnonzero(good)
        self.seen += len(row)
        self.kept.append(self._thinned(points[good], row))
        self.count += len(self.kept[-1][1])
        while self.count > MOST_POINTS:
            self.every *= 2
            self.kept = [self._thinned(*part) for part in self.kept]
            self.count = sum(len(rows) for _, rows in self.kept)

    def _thinned(self, points: Array, row: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
        kept = row // BLOCK_ROWS % self.every == 0
        return points[kept], row[kept]

    def points(self) -> tuple[Array, NDArray[np.int64]]:
        """Return the points (n, 3) and their rows (n,)."""
        if not self.kept:
            return np.empty((0, 3)), np.empty(0, np.int64)
        return np.concatenate([part for part, _ in self.kept]), np.concatenate([rows for _, rows in self.kept])
