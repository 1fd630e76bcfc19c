"""The certificate, the first two pages of the report: values for its template."""

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from pipeline.artefacts.catalogue.points import PASSES
from pipeline.artefacts.catalogue.results import CALIBRATION_JSON
from pipeline.config.about import About
from pipeline.config.session import SessionConfig
from pipeline.config.verdict import VerdictLimits
from pipeline.console import plural
from pipeline.limits.verdict_limits import order_of
from pipeline.maths.survey.sounding_uncertainty import ORDERS, table_of_soundings
from pipeline.mount import WITHIN_95, mount_of
from pipeline.report.method_blocks import mounted_of
from pipeline.results.pages.assumptions import assumed_groups
from pipeline.results.pages.mount_tables import POSITIVE, Quantity
from pipeline.results.pages.sign_drawing import sign_drawings
from pipeline.run import manifest
from pipeline.run.origins import is_recorded
from pipeline.run.results import Tables
from pipeline.run.settings import Settings

Row = Mapping[str, Any]
KNOT = 1852 / 3600  # m/s
DEPTHS_M, ANGLES_DEG = (5.0, 10.0, 20.0, 50.0), (0.0, 45.0, 60.0)
ALWAYS = {  # keys of about: with a row of their own whether they are given or not
    "report_number": "report number", "project": "project", "client": "client", "vessel": "vessel",
    "bracket": "bracket", "place": "place", "surveyor": "surveyor",
}
IF_GIVEN = {
    "weather": "weather", "water_temperature": "water temperature", "sound_speed": "sound speed",
    "target_survey": "survey of the target", "laser_calibration": "calibration of the laser", "datum": "datum",
    "epoch": "epoch", "remarks": "remarks",
}
SENSORS = {"ins": "INS", "laser": "laser scanner", "mbes": "sonar", "sound_speed_probe": "sound speed probe"}


def certificate_values(
    tables: Tables, manifests: Mapping[str, manifest.Manifest], result: Row, settings: Settings, rows: Sequence[Row]
) -> Row:
    """Return the values of certificate.html.

    Parameters
    ----------
    tables
        The run's tables.
    manifests
        The manifests of all stages.
    result
        The content of calibration.json.
    settings
        The run's settings.
    rows
        Rows of :func:`~pipeline.results.pages.mount_tables.parameter_rows`.
    """
    session = settings.session
    block = result[session.calibrated]
    covariance = block["covariance_total"]
    sonar = session.calibrated == "mbes"
    coarse = mount_of(session.sonar.mount if sonar else session.laser.mount)
    return {
        "kind": _kind(result, rows),
        "identity": identity_rows(session.about),
        "about": session.about,
        "instruments": instruments_on_board(session),
        "values": value_rows(rows),
        "drawings": sign_drawings(mounted_of(block) if block["mount"] else coarse, sonar),
        "soundings": _soundings(covariance, settings.limits) if sonar and covariance else None,
        "done": _done(result, sonar),
        "speed": _speed(tables.table(PASSES)),
        "assumed": list(assumed_groups(settings, result["ins_drift"]["from_files"])),
        "assumed_recorded": is_recorded(settings),
        "digests": _digests(manifests, result, settings),
    }


def value_rows(rows: Sequence[Row]) -> list[Row]:
    """Return the certificate's row for each mount parameter, by its row in the report."""
    return [
        {
            "name": row["name"],
            "positive": POSITIVE[row["name"]],
            "value": row["total"].entered(),
            "within": Quantity(WITHIN_95 * row["sigma_total"].number, row["sigma_total"].unit).small(),
            "held": row["held"],
        }
        for row in rows
    ]


def _kind(result: Row, rows: Sequence[Row]) -> str:
    if result["reasons"]:
        return "Calibration record: rejected, not a certificate"
    if not rows[0]["sigma_total"].known:
        return "Calibration record: no certificate, for this method gives no uncertainties"
    return "Calibration certificate, for a part of the values" if result.get("held") else "Calibration certificate"


def identity_rows(about: About) -> list[Row]:
    """Return label and text of each key of ``about`` that the first page shows; None: it is not given."""
    rows = [{"label": label, "text": getattr(about, key)} for key, label in (ALWAYS | IF_GIVEN).items()]
    return [row for row in rows if row["text"] is not None or row["label"] in ALWAYS.values()]


def instruments_on_board(session: SessionConfig) -> list[Row]:
    """Return for each instrument its cells: what it is, serial number and firmware; None: it is not stated.

    What it is stands in ``about``, or else in the title of the session's preset.
    """
    rows: list[Row] = []
    for key, sensor in SENSORS.items():
        about = getattr(session.about.instruments, key)
        block = getattr(session, key, None)
        if block is None and about == type(about)():
            continue
        preset = getattr(block, "instrument", None)
        title = " ".join(filter(None, [about.make, about.model])) or (preset.title if preset else None)
        words = "; ".join(filter(None, [title, about.remarks])) or None
        rows.append({"sensor": sensor, "cells": (words, about.serial, about.firmware)})
    for head, block in session.heads.items():
        if block is not session.mbes:
            title = None if block.instrument is None else block.instrument.title
            rows.append({"sensor": f"sonar, {head}", "cells": (title, None, None)})
    return rows


def _soundings(covariance: Sequence[Sequence[float]], limits: VerdictLimits) -> Row:
    """Return the uncertainties of soundings in mm, beside what S-44 allows, and the largest share of that.

    Limits for a purpose end the depths and the angles: beyond them the values are not to be used.
    """
    order = order_of(limits)
    orders = ORDERS if order is None else (order,)
    depths_m = DEPTHS_M if order is None else _up_to(limits.depth_m, DEPTHS_M)
    angles_deg = ANGLES_DEG if order is None else _up_to(limits.swath_deg, ANGLES_DEG)
    table = table_of_soundings(np.array(covariance), depths_m, angles_deg)
    largest_m = {depth: max(one.vertical_m for one in row) for depth, row in zip(depths_m, table, strict=True)}
    shares = {one.name: max(size / one.vertical_m(depth) for depth, size in largest_m.items()) for one in orders}
    return {
        "angles": ["straight down" if angle == 0 else f"at {angle:g}°" for angle in angles_deg],
        "orders": orders,
        "shares": {name: f"{100 * share:.0f}\u00a0%" for name, share in shares.items()},
        "rows": [
            {
                "depth": f"{depth:g} m",
                "cells": [f"{1000 * one.vertical_m:.0f} / {1000 * one.horizontal_m:.0f}" for one in row],
                "allowed": [f"{1000 * one.vertical_m(depth):.0f}" for one in orders],
            }
            for depth, row in zip(depths_m, table, strict=True)
        ],
    }


def _up_to(last: float, usual: Sequence[float]) -> tuple[float, ...]:
    """Return the usual values below the last one, and that."""
    return (*(value for value in usual if value < last), last)


def _done(result: Row, sonar: bool) -> str:
    """Return in words how many passes saw the target, from where, and with how many points on it."""
    seen = [row for row in result["passes"] if row["soundings"] or row["laser_points"]]
    if not seen:
        return ""
    distances = [row["distance_m"] for row in seen if row["distance_m"] is not None] or [np.nan]
    ends = dict.fromkeys(f"{end(distances):.1f}" for end in (min, max))
    points = {"soundings": "soundings"} if sonar else {}
    points |= {"laser_points": "laser points"}
    counts = [f"{sum(row[key] for row in seen):,} {words}" for key, words in points.items()]
    return f"{plural(len(seen), 'pass')}, {' to '.join(ends)} m from the target, with {' and '.join(counts)} on it"


def _speed(passes: pd.DataFrame) -> str:
    """Return the speeds of the passes in words; empty without passes."""
    speeds = passes["speed_m_s"].to_numpy(dtype=np.float64)
    if not len(speeds):
        return ""
    ends = [f"{speed:.1f}" for speed in (speeds.min(), speeds.max())]
    knots = [f"{speed / KNOT:.1f}" for speed in (speeds.min(), speeds.max())]
    return f"{' to '.join(dict.fromkeys(ends))} m/s ({' to '.join(dict.fromkeys(knots))} kn)"


def _digests(manifests: Mapping[str, manifest.Manifest], result: Row, settings: Settings) -> list[Row]:
    """Return the digests that tie the certificate to files: of all raw files together, both YAML files, the result.

    That of the raw files is of the lines of sha256sum, sorted by name.
    """
    lines = [f"{digest}  {name}\n" for name, digest in sorted(result["inputs"].items())]
    older = "not recorded by the version that made this run"
    return [
        {"file": f"raw files, all {len(lines)}", "sha256": hashlib.sha256("".join(lines).encode()).hexdigest()},
        {"file": "session.yaml", "sha256": settings.files.get("session", older)},
        {"file": "the pool's config", "sha256": settings.files.get("config", older)},
        {"file": CALIBRATION_JSON.name, "sha256": manifests["report"].outputs[CALIBRATION_JSON.name]["sha256"]},
    ]
