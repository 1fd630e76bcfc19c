"""Tables of the report about the target's planes: the plane agreement, and the target as the laser measures it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pipeline.adjustment.residual_tables import FEWEST
from pipeline.artefacts.catalogue.results import CELLS, CLOSING, RESIDUALS
from pipeline.artefacts.catalogue.target import FACES
from pipeline.artefacts.from_tables import family_names
from pipeline.report.as_built import family_title, reference_family
from pipeline.results.pages.mount_tables import METHODS, Quantity
from pipeline.run.results import Tables, calibration

Row = Mapping[str, Any]
SENSORS = ("laser", "mbes")


def plane_agreement_rows(tables: Tables) -> list[dict[str, Any]]:
    """Return the plane agreement of sonar and laser: one row for each plane and mount.

    A family with faces at several distances has no single plane. Its row has NaN for the angle. The distance is the
    mean distance of its points from the adjusted surface, sonar minus laser; it is of the first head alone.
    """
    rows: list[Any] = tables.table(CLOSING).to_dict("records")
    faces = tables.table(FACES)
    names, one_plane = faces["family"].to_numpy(), dict(zip(faces["family"], faces["one_plane"], strict=True))
    columns = ("sensor", "face", "residual_m", "coarse_residual_m")
    residuals, cells = tables.table(RESIDUALS, *columns), tables.table(CELLS)
    family = names[residuals["face"].to_numpy().astype(int)]
    solved = calibration(tables.run, several_heads=True)["methods"]["adjustment"]["mount"] is not None
    for name in family_names(faces):
        of_family = {sensor: residuals[(residuals["sensor"] == sensor) & (family == name)] for sensor in SENSORS}
        counts = cells[cells["family"] == name].groupby("sensor")["count"].sum()
        if one_plane[name] or any(len(points) < FEWEST for points in of_family.values()):
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
    several = any("(" in str(row["mount"]) for row in rows)
    for row in rows:
        mount, _, head = str(row["mount"]).partition(" (")
        row["words"] = METHODS[mount] + (f", {head.removesuffix(')') or 'mbes'}" if several else "")
    return sorted(rows, key=lambda row: str(row["plane"]))


def as_built_rows(measured: Row, design: Row) -> list[Row]:
    """Return one row for each dimension and angle of the target: the value by design, and the laser's measurement."""
    rows = [(letter, design[f"{letter}_m"], measured[f"{letter}_m"], "m") for letter in ("b", "e")]
    angle_between = f"angle between {family_title(reference_family(design['lean_deg']))} and"
    for words, kind in ((angle_between, "corner_deg"), ("leaning of", "lean_deg")):
        rows += [(f"{words} {family}", design[kind][family], angle, "deg") for family, angle in measured[kind].items()]
    return [
        {"name": name, "design": Quantity(design, unit), "found": Quantity(value, unit)}
        for name, design, value, unit in rows
        if value is not None
    ]
