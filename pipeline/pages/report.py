"""RUN/report/report.html: the answer, what it rests on, and where it came from, on one page.

Every number on it is in calibration.json, run.yaml, a manifest or a Parquet of the run, or the difference of two of
them; nothing else is computed here but the pictures' scales, means of residuals and the intervals of means.
"""

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from pipeline import artefacts, config, manifest
from pipeline.built import by_design, reference, titled
from pipeline.drawn import PAGE, agreeing, drawn_from
from pipeline.families import families_of
from pipeline.files import write_text
from pipeline.folder import Settings, calibration, read_settings
from pipeline.maths.solution import TOGETHER
from pipeline.maths.unknowns import NAMES
from pipeline.mounts import PARAMETERS, target_of
from pipeline.pages import render
from pipeline.pages.figures import figures_used
from pipeline.pages.pictures import pictures_of
from pipeline.parsing import changes
from pipeline.residuals import FEWEST
from pipeline.screen import verdict_in_words
from pipeline.tables import Tables
from pipeline.times import utc_text

Row = Mapping[str, Any]
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
SENSORS = ("laser", "mbes")
STRONG = TOGETHER  # correlation that is set in bold
MOST_GAPS = 12
POSITIVE = {
    "roll": "starboard down", "pitch": "bow up", "yaw": "to port",
    "x": "to starboard", "y": "forward", "z": "up",
}
SORTED_BY = {  # what residuals are sorted by, in the report
    "face": "face",
    "angle": "angle",
    "step": "step at a receive angle",
    "ping_2": "ping, one of two against the other",
    "ping_3": "ping, one of three against the others",
    "ping_4": "ping, one of four against the others",
    "distance": "distance",
    "time": "time",
    "pass": "pass, against the others",
    "drift": "drift of a pass, against the others",
}
METHODS = {
    "coarse": "coarse mount",
    "patent_sequential": "(1) patent, angles, then offsets",
    "patent_alternating": "(2) patent, in turn",
    "adjustment": "(3) adjustment",
}


def write_page(run: Path, stages: Sequence[str], pictures: Iterable[Markup]) -> None:
    """Write RUN/report/report.html of a finished run; ``pictures``: those of :func:`pictures_of`, in order."""
    write_text(run / "report" / PAGE, page(Tables(run), agreeing(run, stages), pictures))


def page(tables: Tables, done: Mapping[str, manifest.Manifest], pictures: Iterable[Markup]) -> str:
    """``done``: the manifests of all stages."""
    result, settings = calibration(tables.run), read_settings(tables.run)
    laser = settings.session.calibrated == "laser"
    held = result.get("held", {})
    passes = tables.table(artefacts.PASSES)
    gaps = tables.table(artefacts.GAPS).sort_values("duration_s", ascending=False)
    calibrations, files = tables.table(artefacts.CALIBRATION), tables.table(artefacts.FILES)
    closing = [] if laser else _closing(tables)
    return render(
        "report.html",
        result=result,
        held=[] if result["reasons"] else list(held),
        verdict=verdict_in_words(result["verdict"], held),
        run=tables.run.absolute().name,
        date=str(passes["start_ns"].map(utc_text).min())[:10] if len(passes) else "",
        six=_six(calibrations, result["result"], settings.pool.verdict, held),
        frame=tables.table(artefacts.POOL_FRAME).to_dict("records")[0],
        largest=_largest(tables.table(artefacts.CELLS)),
        tolerated=f"{1000 * settings.pool.adjust.test_tolerance_m:g}",
        level=f"{100 * settings.pool.adjust.test_level:g}",
        tests=[row | {"name": SORTED_BY[row["by"]]} for row in result["geometry"]["patterns"]],
        traced=not laser and settings.session.sonar.svp is not None,
        given_speed=None if laser else settings.session.sonar.sound_speed_m_s,
        speeds=_speeds(files),
        methods=METHODS,
        laser=laser,
        letters=isinstance(settings.pool.target, config.Letters),
        ways=[method for method in METHODS if method in result["methods"] and result["methods"][method]["mount"]],
        by_method=[] if laser else list(_by_method(calibrations)),
        closing=closing,
        spread=list(dict.fromkeys(row["plane"] for row in closing if np.isnan(row["angle_deg"]))),
        shares=list(_shares(tables.table(artefacts.FREED), tables.table(artefacts.ESTIMATE), settings.session)),
        built=_built(result["target"]["as_found"], by_design(target_of(settings.pool.target))),
        names=[name for name, *_ in PARAMETERS],
        correlations=_correlations(result),
        groups=tables.table(artefacts.GROUPS).to_dict("records"),
        summary=tables.table(artefacts.ADJUST_SUMMARY).to_dict("records")[0],
        tracks=passes.to_dict("records"),
        files=files.to_dict("records"),
        gaps=gaps.head(MOST_GAPS).to_dict("records"),
        more_gaps=max(0, len(gaps) - MOST_GAPS),
        counts=[row | {"stage": stage} for stage, one in done.items() for row in one.counts if row["count"]],
        figures=figures_used(settings.session),
        changed=_changed(settings),
        commit=done["report"].git_commit,
        utc=lambda t_ns: utc_text(int(t_ns))[:19].replace("T", " "),
        drawn_from=drawn_from(tables.run, done),
        pictures=dict(zip(pictures_of(tables.run), pictures, strict=True)),  # last: others may still be drawing them
    )


# --- tables ----------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class _Value:
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


def _six(table: pd.DataFrame, method: str, limits: config.Verdict, held: Collection[str]) -> list[dict[str, Any]]:
    rows = table[table["method"] == method].to_dict("records")
    bounds = {"deg": limits.max_sigma_deg, "m": limits.max_sigma_m}
    values = ("coarse", "total", "change", "correction", "sigma_random", "sigma_total", "low_95", "high_95")
    return [
        {"name": row["parameter"], "words": f"{row['parameter']} ({POSITIVE[row['parameter']]})"}
        | {"limit": _Value(bounds[row["unit"]], row["unit"])}
        | {"sigma_in": "°" if row["unit"] == "deg" else "mm", "held": row["parameter"] in held}
        | {key: _Value(row[key], row["unit"]) for key in values}
        for row in rows
    ]


def _closing(tables: Tables) -> list[dict[str, Any]]:
    """How the planes close; of families at several distances, which have no one plane, their points' mean distance from
    the adjusted surface, sonar minus laser."""
    rows: list[Any] = tables.table(artefacts.CLOSING).to_dict("records")
    faces = tables.table(artefacts.FACES)
    names, one_plane = faces["family"].to_numpy(), dict(zip(faces["family"], faces["one_plane"], strict=True))
    columns = ("sensor", "face", "residual_m", "coarse_residual_m")
    residuals, cells = tables.table(artefacts.RESIDUALS, *columns), tables.table(artefacts.CELLS)
    family = names[residuals["face"].to_numpy().astype(int)]
    solved = calibration(tables.run)["methods"]["adjustment"]["mount"] is not None
    for name in families_of(faces):
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


def _shares(freed: pd.DataFrame, estimate: pd.DataFrame, session: config.SessionConfig) -> Iterator[Row]:
    """What each source of errors does to the six (root of its sum of squares), noise first: together the total sigma,
    of the rotations about the body's axes. A laser's mount whose six correlate is one source: what the total has left
    over.
    """
    by_name = estimate.set_index("unknown").reindex(NAMES)
    noise, total = (by_name[name].to_numpy(np.float64) for name in ("sigma", "sigma_total"))
    effects = freed[[f"effect_{name}" for name in NAMES]].to_numpy(np.float64)
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


def _built(found: Row, design: Row) -> list[Row]:
    """What the laser sees of the target, beside its design."""
    rows = [(letter, design[f"{letter}_m"], found[f"{letter}_m"], "m") for letter in ("b", "e")]
    angle_between = f"angle between {titled(reference(design['lean_deg']))} and"
    for words, kind in ((angle_between, "corner_deg"), ("leaning of", "lean_deg")):
        rows += [(f"{words} {family}", design[kind][family], angle, "deg") for family, angle in found[kind].items()]
    return [
        {"name": name, "design": _Value(design, unit), "found": _Value(value, unit)}
        for name, design, value, unit in rows
        if value is not None
    ]


def _largest(cells: pd.DataFrame) -> Row:
    """The mean residual that lies off most."""
    if not len(cells):
        return {"mean_m": np.nan, "sensor": "no points", "family": "", "pass": ""}
    rows: list[Any] = cells.to_dict("records")
    return dict(max(rows, key=lambda row: abs(row["mean_m"])))


def _speeds(files: pd.DataFrame) -> str:
    """The sound speeds recorded, from the lowest to the highest."""
    low, high = files["sound_speed_low_m_s"].min(), files["sound_speed_high_m_s"].max()
    if not np.isfinite(low):
        return ""
    return f"{low:.1f} m/s" if high - low < 0.05 else f"{low:.1f} to {high:.1f} m/s"


def _by_method(table: pd.DataFrame) -> Iterator[Row]:
    """A row a parameter: each method's total, and how far it lies from the adjustment's."""
    for name, _, _, unit in PARAMETERS:
        rows = table[table["parameter"] == name].set_index("method")
        totals = {method: float(rows["total"][method]) for method in METHODS if method != "coarse"}
        away = {method: value - totals["adjustment"] for method, value in totals.items()}
        if unit == "deg":
            away = {method: value - 360.0 * np.round(value / 360.0) for method, value in away.items()}
        yield {
            "name": name,
            "totals": {method: _Value(value, unit) for method, value in totals.items()},
            "away": {method: _Value(value, unit) for method, value in away.items()},
        }


def _correlations(result: Row) -> list[dict[str, Any]] | None:
    """In the order of the six; None where there is no solution."""
    matrix = result["geometry"]["correlation"]
    if matrix is None:
        return None
    places = [place for _, place, *_ in PARAMETERS]

    def cell(row: int, column: int) -> Row:
        value = matrix[row][column]
        return {"value": value, "strong": row != column and abs(value) >= STRONG}

    return [{"name": name, "cells": [cell(row, column) for column in places]} for name, row, *_ in PARAMETERS]


def _changed(settings: Settings) -> list[dict[str, str]]:
    """What differs from the defaults, then what has none."""

    def shown(value: Any) -> str:
        return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)

    rows = [
        {"where": where, "key": key, "default": "" if default is None else shown(default), "value": shown(value)}
        for where, model in (("pool", settings.pool), ("session", settings.session))
        for key, default, value in changes(model)
        if ".instrument." not in key  # these have a table of their own
    ]
    return sorted(rows, key=lambda row: not row["default"])
