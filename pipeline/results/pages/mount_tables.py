"""Tables of the report about the six values of a mount: the values themselves, what their sigmas are made of, their
correlations, how the methods differ, how the planes close, and what the laser sees of the target beside its design."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline.adjustment.residual_tables import FEWEST
from pipeline.artefacts.catalogue.results import CELLS, CLOSING, RESIDUALS
from pipeline.artefacts.catalogue.target import FACES
from pipeline.artefacts.from_tables import family_names
from pipeline.config.pool import Verdict
from pipeline.config.session import SessionConfig
from pipeline.maths.adjustment.estimability import CORRELATION_LIMIT
from pipeline.maths.mount_parameters import MOUNT_NAMES, PARAMETERS
from pipeline.report.as_built import family_title, reference_family
from pipeline.run.results import Tables, calibration

Row = Mapping[str, Any]
SENSORS = ("laser", "mbes")
OF_MOUNT = ("the laser's angles", "the laser's lever arm")
SOURCES = (  # first part of the unknowns' names
    ("laser_rotation", OF_MOUNT[0]),
    ("laser_lever_arm", OF_MOUNT[1]),
    ("laser_range", "the laser's ranges"),
    ("laser_latency", "the laser's clock"),
    ("mbes_range", "the sonar's ranges"),
    ("mbes_latency", "the sonar's clock"),
    ("sound_speed_gradient", "change of the sound speed with depth"),
    ("sound_speed", "sound speed"),
    ("wet", "wet faces against dry ones"),
    ("rotation", "angles that are held"),  # of a laser that is calibrated
    ("lever_arm", "lever arm that is held"),
)
STRONG = CORRELATION_LIMIT  # correlation that is set in bold
POSITIVE = {
    "roll": "starboard down", "pitch": "bow up", "yaw": "to port",
    "x": "to starboard", "y": "forward", "z": "up",
}
METHODS = {
    "coarse": "coarse mount",
    "patent_sequential": "(1) patent, angles, then offsets",
    "patent_alternating": "(2) patent, in turn",
    "adjustment": "(3) adjustment",
}


@dataclass(frozen=True)
class Value:
    """A number with its unit, as people read it; "-" where there is none."""

    number: float
    unit: str

    def __str__(self) -> str:
        return self.text()

    @property
    def known(self) -> bool:
        return bool(np.isfinite(self.number))

    def text(self, sign: str = "") -> str:
        if not np.isfinite(self.number):
            return "–"
        return f"{round(self.number, 4) + 0.0:{sign}.4f} {'°' if self.unit == 'deg' else self.unit}"

    def entered(self) -> str:
        """As one enters it: 0.001°, and metres to the tenth of a millimetre."""
        return f"{round(self.number, 3) + 0.0:.3f} °" if self.known and self.unit == "deg" else self.text()

    def small(self, sign: str = "") -> str:
        """A change or a sigma: 0.001°, and millimetres with one decimal."""
        if not self.known:
            return "–"
        number, unit, digits = (self.number, "°", 3) if self.unit == "deg" else (1000 * self.number, "mm", 1)
        return f"{round(number, digits) + 0.0:{sign}.{digits}f} {unit}"


def six(table: pd.DataFrame, method: str, limits: Verdict, held: Collection[str]) -> list[dict[str, Any]]:
    rows = table[table["method"] == method].to_dict("records")
    bounds = {"deg": limits.max_sigma_deg, "m": limits.max_sigma_m}
    values = ("coarse", "total", "change", "correction", "sigma_random", "sigma_total", "low_95", "high_95")
    return [
        {"name": row["parameter"], "words": f"{row['parameter']} ({POSITIVE[row['parameter']]})"}
        | {"limit": Value(bounds[row["unit"]], row["unit"])}
        | {"sigma_in": "°" if row["unit"] == "deg" else "mm", "held": row["parameter"] in held}
        | {key: Value(row[key], row["unit"]) for key in values}
        for row in rows
    ]


def closing(tables: Tables) -> list[dict[str, Any]]:
    """How the planes close; of families at several distances, which have no one plane, their points' mean distance from
    the adjusted surface, sonar minus laser."""
    rows: list[Any] = tables.table(CLOSING).to_dict("records")
    faces = tables.table(FACES)
    names, one_plane = faces["family"].to_numpy(), dict(zip(faces["family"], faces["one_plane"], strict=True))
    columns = ("sensor", "face", "residual_m", "coarse_residual_m")
    residuals, cells = tables.table(RESIDUALS, *columns), tables.table(CELLS)
    family = names[residuals["face"].to_numpy().astype(int)]
    solved = calibration(tables.run)["methods"]["adjustment"]["mount"] is not None
    for name in family_names(faces):
        of_family = {sensor: residuals[(residuals["sensor"] == sensor) & (family == name)] for sensor in SENSORS}
        counts = cells[cells["family"] == name].groupby("sensor")["count"].sum()
        if one_plane[name] or any(len(one) < FEWEST for one in of_family.values()):
            continue
        for mount, column in (("coarse", "coarse_residual_m"), ("adjustment", "residual_m"))[: 1 + solved]:
            sonar, laser = of_family["mbes"][column], of_family["laser"]["residual_m"]
            if not (np.isfinite(sonar).all() and np.isfinite(laser).all()):
                continue
            rows.append(
                {
                    "mount": mount,
                    "plane": name,
                    "angle_deg": np.nan,
                    "distance_m": float(sonar.mean() - laser.mean()),
                    "rms_m": float(sonar.std(ddof=0)),
                    "soundings": int(counts.get("mbes", 0)),
                    "laser_points": int(counts.get("laser", 0)),
                }
            )
    return sorted(rows, key=lambda row: str(row["plane"]))


def shares(freed: pd.DataFrame, estimate: pd.DataFrame, session: SessionConfig) -> Iterator[Row]:
    """What each source of errors does to the six (root of its sum of squares), noise first: together the total sigma,
    of the rotations about the body's axes. A laser's mount whose six correlate is one source: what the total has left
    over.
    """
    by_name = estimate.set_index("unknown").reindex(MOUNT_NAMES)
    noise, total = (by_name[name].to_numpy(np.float64) for name in ("sigma", "sigma_total"))
    effects = freed[[f"effect_{name}" for name in MOUNT_NAMES]].to_numpy(np.float64)
    source = freed["unknown"].map(lambda name: next((words for start, words in SOURCES if name.startswith(start)), ""))
    there = [words for _, words in SOURCES if (source == words).any()]
    squares = {words: np.sum(effects[(source == words).to_numpy()] ** 2, axis=0) for words in there}
    if session.calibrated == "mbes" and session.laser.mount_covariance is not None:
        others = {words: square for words, square in squares.items() if words not in OF_MOUNT}
        left = total**2 - noise**2 - np.sum(list(others.values()), axis=0)
        squares = {"the laser's mount": np.maximum(left, 0.0), **others}
    for words, of_source in {"noise (the random sigma)": noise**2, **squares}.items():
        yield {
            "name": words,
            "cells": [
                f"{np.degrees(sigma):.4f}" if unit == "deg" else f"{1000 * sigma:.2f}"
                for sigma, unit in ((np.sqrt(of_source[place]), unit) for _, place, _, unit in PARAMETERS)
            ],
        }


def built(found: Row, design: Row) -> list[Row]:
    """What the laser sees of the target, beside its design."""
    rows = [(letter, design[f"{letter}_m"], found[f"{letter}_m"], "m") for letter in ("b", "e")]
    angle_between = f"angle between {family_title(reference_family(design['lean_deg']))} and"
    for words, kind in ((angle_between, "corner_deg"), ("leaning of", "lean_deg")):
        rows += [(f"{words} {family}", design[kind][family], angle, "deg") for family, angle in found[kind].items()]
    return [
        {"name": name, "design": Value(design, unit), "found": Value(value, unit)}
        for name, design, value, unit in rows
        if value is not None
    ]


def by_method(table: pd.DataFrame) -> Iterator[Row]:
    """A row a parameter: each method's total, and how far it lies from the adjustment's."""
    for name, _, _, unit in PARAMETERS:
        rows = table[table["parameter"] == name].set_index("method")
        totals = {method: float(rows["total"][method]) for method in METHODS if method != "coarse"}
        away = {method: value - totals["adjustment"] for method, value in totals.items()}
        if unit == "deg":
            away = {method: value - 360.0 * np.round(value / 360.0) for method, value in away.items()}
        yield {
            "name": name,
            "totals": {method: Value(value, unit) for method, value in totals.items()},
            "away": {method: Value(value, unit) for method, value in away.items()},
        }


def correlations(result: Row) -> list[dict[str, Any]] | None:
    """In the order of the six; None where there is no solution."""
    matrix = result["geometry"]["correlation"]
    if matrix is None:
        return None
    places = [place for _, place, *_ in PARAMETERS]

    def cell(row: int, column: int) -> Row:
        value = matrix[row][column]
        return {"value": value, "strong": row != column and abs(value) >= STRONG}

    return [{"name": name, "cells": [cell(row, column) for column in places]} for name, row, *_ in PARAMETERS]
