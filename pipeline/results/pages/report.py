"""RUN/report/report.html: the result, its evidence and its provenance on one page.

Every number on it stands in calibration.json, run.yaml, a manifest or a Parquet file of the run, or is the difference
of two such numbers. The modules of the page compute only the scales of pictures, means and scatter of residuals,
intervals of means, and the sums of squares in the table of contributions to the sigmas.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from pipeline.artefacts.catalogue.points import FILES, GAPS, PASSES, POOL_FRAME
from pipeline.artefacts.catalogue.results import (
    ADJUST_SUMMARY,
    CALIBRATION,
    CELLS,
    DRIFT_FIGURES,
    ESTIMATE,
    FREED,
    GROUPS,
    RESIDUAL_MAP,
)
from pipeline.artefacts.catalogue.target import FACES
from pipeline.artefacts.counts import sensor_of
from pipeline.artefacts.from_tables import family_names
from pipeline.atomic_files import write_text
from pipeline.config.changes import changed_settings
from pipeline.config.target import Letters
from pipeline.gps_time import utc_text
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.maths.target.bottom_names import PIECES
from pipeline.maths.target.family_words import families_in_words
from pipeline.report.as_built import design_shape, reference_family
from pipeline.report.reason_codes import ReasonCode, verdict_of
from pipeline.report.sigma_sources import contributions, laser_correlates
from pipeline.results.pages.certificate import certificate_values, value_rows
from pipeline.results.pages.currency import page_digest
from pipeline.results.pages.drift_words import drift_rows, drift_sentence
from pipeline.results.pages.face_maps import families_of_maps
from pipeline.results.pages.families import shown_names
from pipeline.results.pages.instrument_table import instrument_rows
from pipeline.results.pages.limiting_errors import limiting_sentences
from pipeline.results.pages.mount_tables import METHODS, correlation_rows, method_rows, parameter_rows, part_rows
from pipeline.results.pages.parameter_tests import parameter_test_rows, untold_parameters
from pipeline.results.pages.patent_check import patent_check
from pipeline.results.pages.plane_tables import as_built_rows, plane_agreement_rows
from pipeline.results.pages.plots import picture_names
from pipeline.results.pages.rendering import render_page
from pipeline.results.pages.sigma_sources import sigma_source_rows, slot_checks
from pipeline.run import manifest
from pipeline.run.origins import DEFAULT, POOL, SESSION, origin_of
from pipeline.run.results import PAGE, Tables, agreeing, calibration
from pipeline.run.settings import Settings, read_settings
from pipeline.target.design import target_of

Row = Mapping[str, Any]
MOST_GAPS = 12
SORTED_BY = {  # names in the report of the variables along which residuals are averaged
    "face": "face",
    "angle": "angle",
    "step": "step at a receive angle",
    "height": "step at a height above the water",
    "ping_2": "ping, one of two against the other",
    "ping_3": "ping, one of three against the others",
    "ping_4": "ping, one of four against the others",
    "distance": "distance",
    "time": "time",
    "pass": "pass, against the others",
    "drift": "drift of a pass, against the others",
}


def write_report_page(run: Path, stages: Sequence[str], pictures: Iterable[Markup]) -> None:
    """Write RUN/report/report.html of a finished run.

    Parameters
    ----------
    run
        The run folder.
    stages
        Names of the run's stages.
    pictures
        The pictures of :func:`~pipeline.results.pages.plots.picture_names`, in order.
    """
    write_text(run / "report" / PAGE, report_page(Tables(run), agreeing(run, stages), pictures))


def report_page(tables: Tables, manifests: Mapping[str, manifest.Manifest], pictures: Iterable[Markup]) -> str:
    """Return the report's page.

    Parameters
    ----------
    tables
        The run's tables.
    manifests
        The manifests of all stages.
    pictures
        The pictures of :func:`~pipeline.results.pages.plots.picture_names`, in order.
    """
    result, settings = calibration(tables.run, several_heads=True), read_settings(tables.run)
    return render_page(
        "report.html",
        result=result,
        methods=METHODS,
        laser=settings.session.calibrated == "laser",
        **_result_values(tables, manifests, result, settings),
        **_residual_values(tables, result, settings),
        **_data_values(tables, manifests, result, settings),
        drawn_from=page_digest(tables.run, manifests),
        pictures=dict(zip(picture_names(tables.run), pictures, strict=True)),
    )


def _result_values(
    tables: Tables, manifests: Mapping[str, manifest.Manifest], result: Row, settings: Settings
) -> Row:
    """Return the template's values about the mount and the target, and those of the certificate."""
    laser = settings.session.calibrated == "laser"
    held = result.get("held", {})
    passes, calibrations = tables.table(PASSES), tables.table(CALIBRATION)
    planes = [] if laser else plane_agreement_rows(tables)
    methods = [method for method in METHODS if method in result["methods"]]
    rows = parameter_rows(calibrations, result["result"], settings.limits, held)
    correlates = laser_correlates(settings.session.calibrated, settings.session.laser.mount_covariance)
    sources = contributions(tables.table(FREED), result["methods"]["adjustment"], correlates)
    heads = []
    for head in result.get("heads", [])[1:]:
        of_head = parameter_rows(calibrations, f"{result['result']} ({head['name']})", settings.limits, held)
        heads.append({"name": head["name"], "parameters": of_head, "values": value_rows(of_head)})
    return {
        "heads": heads,
        "certificate": certificate_values(tables, manifests, result, settings, rows),
        "limiting": list(limiting_sentences(sources, rows, ReasonCode.ROUGH_WALL in result["warning_codes"])),
        "held": [] if result["reasons"] else list(held),
        "verdict": verdict_of(result),
        "run": tables.run.absolute().name,
        "date": str(passes["start_ns"].map(utc_text).min())[:10] if len(passes) else "",
        "parameters": rows,
        "names": [name for name, *_ in PARAMETERS],
        "frame": tables.table(POOL_FRAME).to_dict("records")[0],
        "traced": not laser and settings.session.sonar.svp is not None,
        "configured_speed": None if laser else settings.session.sonar.sound_speed_m_s,
        "speeds": _speeds(tables.table(FILES)),
        "letters": isinstance(settings.pool.target, Letters),
        "found": target_of(settings.pool.target).found,
        "solved_methods": [method for method in methods if result["methods"][method]["mount"]],
        "patent_check": "" if laser else patent_check(result["methods"]),
        "faces_in_words": families_in_words(target_of(settings.pool.target)),
        "by_method": [] if laser else list(method_rows(calibrations)),
        "planes": planes,
        "several_planes": list(dict.fromkeys(row["plane"] for row in planes if np.isnan(row["angle_deg"]))),
        "sigma_sources": list(sigma_source_rows(sources)),
        "slot_checks": slot_checks(tables.table(ESTIMATE)),
        "as_built": as_built_rows(result["target"]["as_found"], design_shape(target_of(settings.pool.target))),
        "correlations": correlation_rows(result),
    }


def _residual_values(tables: Tables, result: Row, settings: Settings) -> Row:
    """Return the template's values about the residuals."""
    codes = [*result["reason_codes"], *result["warning_codes"]]
    faces, cells = tables.table(FACES), tables.table(RESIDUAL_MAP)
    families = family_names(faces)
    return {
        "example": reference_family(families),
        "kinds": ", ".join([*families[:2], *("…" for _ in families[2:3])]),
        "pieces": PIECES in shown_names(families) and PIECES not in families,
        "not_shown": {sensor: families_of_maps(cells, faces, sensor)[1] for sensor in ("laser", "mbes")},
        "largest": _largest(tables.table(CELLS)),
        "tolerated": f"{1000 * settings.pool.adjust.test_tolerance_m:g}",
        "level": f"{100 * settings.pool.adjust.test_level:g}",
        "tests": [row | {"name": SORTED_BY[row["by"]]} for row in result["geometry"]["patterns"]],
        "parts": part_rows(result.get("parts", [])),
        "untold": untold_parameters(tables.table(FREED)),
        "parameter_tests": list(parameter_test_rows(tables.table(FREED), settings.pool.adjust.test_level)),
        "groups": tables.table(GROUPS).to_dict("records"),
        "drift_figures": drift_rows(tables.table(DRIFT_FIGURES)),
        "drift_in_words": drift_sentence(tables.table(DRIFT_FIGURES), codes),
        "summary": tables.table(ADJUST_SUMMARY).to_dict("records")[0],
    }


def _data_values(
    tables: Tables, manifests: Mapping[str, manifest.Manifest], result: Row, settings: Settings
) -> Row:
    """Return the template's values about passes, files, counts, settings and provenance."""
    gaps = tables.table(GAPS).sort_values("duration_s", ascending=False)
    counts = [
        row | {"stage": stage, "sensor": sensor_of(row["source"])}
        for stage, of_stage in manifests.items()
        for row in of_stage.counts
    ]
    return {
        "tracks": tables.table(PASSES).to_dict("records"),
        "files": tables.table(FILES).to_dict("records"),
        "gaps": gaps.head(MOST_GAPS).to_dict("records"),
        "more_gaps": max(0, len(gaps) - MOST_GAPS),
        "counts": [row for row in counts if row["count"]],
        "figures": instrument_rows(settings, result["ins_drift"]),
        "changed": _changed(settings),
        "commit": manifests["report"].git_commit,
        "utc": lambda t_ns: utc_text(int(t_ns))[:19].replace("T", " "),
    }


def _largest(cells: pd.DataFrame) -> Row | None:
    """Return the row of ``cells`` with the largest mean residual, whatever its sign; None if there are none."""
    if not len(cells):
        return None
    rows: list[Any] = cells.to_dict("records")
    return dict(max(rows, key=lambda row: abs(row["mean_m"])))


def _speeds(files: pd.DataFrame) -> str:
    """Return the lowest and the highest recorded sound speed as text; empty if none is recorded."""
    low, high = files["sound_speed_low_m_s"].min(), files["sound_speed_high_m_s"].max()
    if not np.isfinite(low):
        return ""
    return f"{low:.1f} m/s" if high - low < 0.05 else f"{low:.1f} to {high:.1f} m/s"


def _changed(settings: Settings) -> list[dict[str, str]]:
    """Return one row for each setting that differs from its default, then one for each setting without a default."""

    def shown(value: Any) -> str:
        return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)

    rows = [
        {
            "origin": _origin(settings, key),
            "key": key,
            "default": "" if default is None else shown(default),
            "value": shown(value),
        }
        for model in (settings.pool, settings.session)
        for key, default, value in changed_settings(model)
        if ".instrument." not in key and not key.startswith("about.")  # these stand elsewhere on the page
    ]
    return sorted(rows, key=lambda row: not row["default"])


def _origin(settings: Settings, key: str) -> str:
    """Return where a value that is not the default comes from; the program sets some, such as those of a cast's file.

    A list of blocks, or a block whose keys are free names, is given as a whole.
    """
    origin = origin_of(settings, key, changed=True)
    if origin != DEFAULT:
        return origin
    stated = [one for keys in settings.stated.values() for one in keys]
    given = any(one.startswith(f"{key}.") or key.startswith(f"{one}.") for one in stated)
    file = SESSION if key.partition(".")[0] in type(settings.session).model_fields else POOL
    return file if given else "set by poolcal"
