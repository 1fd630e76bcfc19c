"""The report's pictures. Each is drawn from a run's tables alone, so that several processes can share the work."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from numpy.typing import NDArray

from pipeline.artefacts.catalogue.patent import ALTERNATION, ITERATIONS
from pipeline.artefacts.catalogue.points import PASSES, POOL_FRAME, POSES
from pipeline.artefacts.catalogue.results import ADJUST_SUMMARY, CELLS, PATTERNS, RESIDUAL_BINS, RESIDUAL_MAP, RESIDUALS
from pipeline.artefacts.catalogue.target import FACES, TARGET_POSE
from pipeline.artefacts.from_tables import family_names, trajectory_in_target
from pipeline.config.target import Letters
from pipeline.maths.geometry.passes import pass_of
from pipeline.results.pages import face_maps, height_chart, residual_plots, target_plots, track_plan
from pipeline.results.pages.rendering import drawing_style
from pipeline.run.results import Tables, calibration
from pipeline.run.settings import read_settings
from pipeline.target.design import target_of

TRACK_POINTS = 300  # a long pass has one to two times this number in the plan


def draw_picture(run: Path, name: str) -> Markup:
    """Return a picture of a run's report; ``name``: a key of :data:`PICTURES`."""
    with drawing_style():
        return PICTURES[name](Tables(run))


def _residuals(tables: Tables) -> Markup:
    passes = tables.table(PASSES)
    families = family_names(tables.table(FACES))
    return residual_plots.residual_charts(tables.table(RESIDUAL_BINS), tables.table(CELLS), passes, families)


def _heights(tables: Tables) -> Markup:
    pool, faces = read_settings(tables.run).pool, tables.table(FACES)
    residuals = tables.table(RESIDUALS, *height_chart.HEIGHTS)
    means = height_chart.means_by_height(residuals, faces, target_of(pool.target).water_level_m)
    limit = float(tables.table(ADJUST_SUMMARY)["test_limit"].iloc[0])
    return height_chart.height_chart(means, tables.table(PATTERNS), faces, pool.adjust.test_tolerance_m, limit)


def _distances(tables: Tables) -> Markup:
    residuals = tables.table(RESIDUALS, *target_plots.DISTANCES)
    faces = tables.table(FACES)
    return target_plots.distance_charts(residuals, faces, _family(residuals, tables), _solved(tables))


def _sections(tables: Tables) -> Markup:
    residuals = tables.table(RESIDUALS, *target_plots.SECTIONS)
    letters = isinstance(read_settings(tables.run).pool.target, Letters)
    return target_plots.target_sections(residuals, tables.table(FACES), _solved(tables), letters)


def _map_laser(tables: Tables) -> Markup:
    return face_maps.residual_maps(tables.table(RESIDUAL_MAP), tables.table(FACES), "laser")


def _map_mbes(tables: Tables) -> Markup:
    return face_maps.residual_maps(tables.table(RESIDUAL_MAP), tables.table(FACES), "mbes")


def _convergence(tables: Tables) -> Markup:
    return residual_plots.convergence_charts(tables.table(ITERATIONS), tables.table(ALTERNATION))


def _tracks(tables: Tables) -> Markup:
    """Draw the track of the INS in each pass, target frame."""
    poses, passes, pose = (tables.table(artefact) for artefact in (POSES, PASSES, TARGET_POSE))
    trajectory = trajectory_in_target(poses, pose)
    number = pass_of(*(column.to_numpy() for column in (poses["t_ns"], passes["start_ns"], passes["end_ns"])))
    positions_m = {}
    for pass_number in passes["pass"].tolist():
        track = trajectory.positions_m[number == pass_number]
        if len(track):
            positions_m[int(pass_number)] = track[:: max(1, len(track) // TRACK_POINTS)]
    azimuth_deg = tables.table(POOL_FRAME)["azimuth_deg"].iloc[0] + pose["azimuth_correction_deg"].iloc[0]
    return track_plan.pass_tracks(positions_m, tables.table(FACES), float(azimuth_deg))


def _family(residuals: pd.DataFrame, tables: Tables) -> NDArray[Any]:
    """Return the family of each residual's face."""
    family = tables.table(FACES)["family"].to_numpy()
    return np.asarray(family[residuals["face"].to_numpy().astype(int)])


def _solved(tables: Tables) -> bool:
    return calibration(tables.run, several_heads=True)["methods"]["adjustment"]["mount"] is not None


def picture_names(run: Path) -> list[str]:
    """Return the names of the pictures in the run's report, in the order of PICTURES."""
    laser = read_settings(run).session.calibrated == "laser"
    iterated = not laser and len(Tables(run).table(ITERATIONS)) > 0
    without = (("map_mbes",) if laser else ()) + (() if iterated else ("convergence",))
    return [name for name in PICTURES if name not in without]


PICTURES = {  # the pictures that take longest come first
    "residuals": _residuals,
    "heights": _heights,
    "distances": _distances,
    "sections": _sections,
    "map_mbes": _map_mbes,
    "map_laser": _map_laser,
    "convergence": _convergence,
    "tracks": _tracks,
}
