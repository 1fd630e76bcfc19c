"""RUN/report/report.html: the answer, what it rests on, and where it came from, on one page.

Every number on it is in calibration.json, run.yaml, a manifest or a Parquet of the run, or the difference of two of
them; nothing else is computed here but the pictures' scales, means of residuals and the intervals of means.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from pipeline.artefacts.catalogue.points import FILES, GAPS, PASSES, POOL_FRAME
from pipeline.artefacts.catalogue.results import ADJUST_SUMMARY, CALIBRATION, CELLS, ESTIMATE, FREED, GROUPS
from pipeline.atomic_files import write_text
from pipeline.config.changes import changed_settings
from pipeline.config.target import Letters
from pipeline.gps_time import utc_text
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.report.as_built import by_design
from pipeline.results.pages import mount_tables
from pipeline.results.pages.currency import drawn_from
from pipeline.results.pages.instrument_table import figures_used
from pipeline.results.pages.mount_tables import METHODS
from pipeline.results.pages.plots import pictures_of
from pipeline.results.pages.rendering import render
from pipeline.results.screen import verdict_in_words
from pipeline.run import manifest
from pipeline.run.results import PAGE, Tables, agreeing, calibration
from pipeline.run.settings import Settings, read_settings
from pipeline.target.design import target_of

Row = Mapping[str, Any]
MOST_GAPS = 12
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


def write_page(run: Path, stages: Sequence[str], pictures: Iterable[Markup]) -> None:
    """Write RUN/report/report.html of a finished run; ``pictures``: those of :func:`pictures_of`, in order."""
    write_text(run / "report" / PAGE, page(Tables(run), agreeing(run, stages), pictures))


def page(tables: Tables, done: Mapping[str, manifest.Manifest], pictures: Iterable[Markup]) -> str:
    """``done``: the manifests of all stages."""
    result, settings = calibration(tables.run), read_settings(tables.run)
    laser = settings.session.calibrated == "laser"
    held = result.get("held", {})
    passes = tables.table(PASSES)
    gaps = tables.table(GAPS).sort_values("duration_s", ascending=False)
    calibrations, files = tables.table(CALIBRATION), tables.table(FILES)
    estimate = tables.table(ESTIMATE)
    closing = [] if laser else mount_tables.closing(tables)
    return render(
        "report.html",
        result=result,
        held=[] if result["reasons"] else list(held),
        verdict=verdict_in_words(result["verdict"], held),
        run=tables.run.absolute().name,
        date=str(passes["start_ns"].map(utc_text).min())[:10] if len(passes) else "",
        six=mount_tables.six(calibrations, result["result"], settings.pool.verdict, held),
        frame=tables.table(POOL_FRAME).to_dict("records")[0],
        largest=_largest(tables.table(CELLS)),
        tolerated=f"{1000 * settings.pool.adjust.test_tolerance_m:g}",
        level=f"{100 * settings.pool.adjust.test_level:g}",
        tests=[row | {"name": SORTED_BY[row["by"]]} for row in result["geometry"]["patterns"]],
        traced=not laser and settings.session.sonar.svp is not None,
        given_speed=None if laser else settings.session.sonar.sound_speed_m_s,
        speeds=_speeds(files),
        methods=METHODS,
        laser=laser,
        letters=isinstance(settings.pool.target, Letters),
        ways=[method for method in METHODS if method in result["methods"] and result["methods"][method]["mount"]],
        by_method=[] if laser else list(mount_tables.by_method(calibrations)),
        closing=closing,
        spread=list(dict.fromkeys(row["plane"] for row in closing if np.isnan(row["angle_deg"]))),
        shares=list(mount_tables.shares(tables.table(FREED), estimate, settings.session)),
        built=mount_tables.built(result["target"]["as_found"], by_design(target_of(settings.pool.target))),
        names=[name for name, *_ in PARAMETERS],
        correlations=mount_tables.correlations(result),
        groups=tables.table(GROUPS).to_dict("records"),
        summary=tables.table(ADJUST_SUMMARY).to_dict("records")[0],
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
        pictures=dict(zip(pictures_of(tables.run), pictures, strict=True)),
    )


# --- tables ----------------------------------------------------------------------------------------------------------
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


def _changed(settings: Settings) -> list[dict[str, str]]:
    """What differs from the defaults, then what has none."""

    def shown(value: Any) -> str:
        return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)

    rows = [
        {"where": where, "key": key, "default": "" if default is None else shown(default), "value": shown(value)}
        for where, model in (("pool", settings.pool), ("session", settings.session))
        for key, default, value in changed_settings(model)
        if ".instrument." not in key  # these have a table of their own
    ]
    return sorted(rows, key=lambda row: not row["default"])
