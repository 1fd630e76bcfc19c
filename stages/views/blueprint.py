"""The viewer's layout (Rerun calls it blueprint): tabs from the whole scene to the quality of the data."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.artefacts.catalogue.patent import ITERATIONS
from pipeline.artefacts.parquet import row_count
from pipeline.maths.target.model import ROLES, TargetModel
from pipeline.run.settings import read_settings
from pipeline.target.design import target_of

PAPER = (255, 255, 255)
FROM = (-1.0, -0.55, 0.45)  # the eye is in this direction from the target's middle
DISTANCE = 2.0  # from the target's middle to the eye, in halves of the target's diagonal
TABS = ("Overview", "Before and after", "Iteration", "Residuals", "Quality")


def tabs_of(run: Path) -> tuple[str, ...]:
    """Return the names in TABS for which the run has entities.

    A run that calibrates a laser has no soundings before and after, and no iteration. The patent's iteration needs a
    target with all roles, and at least one step. Before the stage has run, steps are expected.
    """
    overview, change, _, left, quality = TABS
    settings = read_settings(run)
    if settings.session.calibrated == "laser":
        return overview, left, quality
    steps = run / ITERATIONS.owner / f"{ITERATIONS.name}.parquet"
    families = {family.name for family in target_of(settings.pool.target).families}
    if not families.issuperset(ROLES) or (steps.is_file() and not row_count(steps)):
        return overview, change, left, quality
    return TABS


def run_blueprint(tabs: Sequence[str], model: TargetModel) -> Any:
    """Return the layout of a run's recordings. Scenes after the overview share one viewpoint on the whole target.

    Parameters
    ----------
    tabs
        The names in TABS to show.
    model
        The target.
    """
    import rerun.blueprint as rrb

    overview, change, iteration, left, quality = TABS
    scene = partial(_scene_of, eye=_eye(model))
    every = (
        rrb.Horizontal(
            _scene_of("The boat before the target", "/pool/**", "/target/**", "/fans/**", "/boat/**"),
            _words("/tables/summary", "Summary"),
            column_shares=[3, 2],
            name=overview,
        ),
        rrb.Horizontal(
            scene("Soundings and their planes with the coarse mount", "/before/**", "/target/**", "/planes/mbes/**"),
            scene("Soundings with the calibrated mount", "/after/**", "/target/**"),
            name=change,
        ),
        rrb.Horizontal(
            rrb.Vertical(
                scene("The patent: step by step, offsets not yet applied", "/iteration/**", "/target/model/**"),
                scene("The adjustment: from coarse to calibrated", "/replay/**", "/target/model/**"),
            ),
            rrb.Vertical(
                _curves("/curves/deviation", "Deviation of the sonar's planes, degrees"),
                _curves("/curves/planes", "Angle between sonar's and laser's planes, degrees"),
                _curves("/curves/turns", "Angles and offsets in turn: what a turn still changes"),
            ),
            column_shares=[3, 2],
            name=iteration,
        ),
        rrb.Horizontal(
            scene("Points by residual", "/residuals/**", "/target/model/**"),
            scene("Mean residual over the faces", "/maps/**", "/target/model/**"),
            _words("/tables/residuals", "Residuals"),
            column_shares=[2, 2, 2],
            name=left,
        ),
        rrb.Horizontal(
            rrb.Vertical(
                _curves("/quality/attitude", "Attitude, degrees"),
                _curves("/quality/points", "Points on the target in a second"),
                _curves("/quality/residual", "Mean residual of a second, mm"),
            ),
            rrb.Vertical(_words("/tables/files", "Files"), _words("/tables/how_to_read", "How to read this")),
            column_shares=[3, 2],
            name=quality,
        ),
    )
    shown = [tab for tab in every if tab.name in tabs]
    return _blueprint(*shown, timeline="iteration" if iteration in tabs else "time")


def two_runs_blueprint() -> Any:
    """Return the layout for two runs, a and b: each on its own target, both on one, and their difference as text."""
    import rerun.blueprint as rrb

    return _blueprint(
        rrb.Horizontal(
            _scene_of("a: soundings, calibrated", "/a/after/**", "/a/target/model/**"),
            _scene_of("b: soundings, calibrated", "/b/after/**", "/b/target/model/**"),
            name="Side by side",
        ),
        rrb.Horizontal(
            _scene_of("Both with the mount of a: a blue, b orange", "/both/**", "/a/target/model/**"),
            name="On one target",
        ),
        rrb.Horizontal(
            _words("/tables/comparison", "Comparison"),
            _words("/a/tables/summary", "a"),
            _words("/b/tables/summary", "b"),
            name="In words",
        ),
    )


def place_blueprint() -> Any:
    """Return the layout for a found place: its planes, the faces alone, and the table."""
    import rerun.blueprint as rrb

    def tab(name: str, title: str, *contents: str) -> Any:
        words = _words("/tables/place", "Planes")
        return rrb.Vertical(_scene_of(title, *contents), words, row_shares=[2, 1], name=name)

    return _blueprint(
        tab("Place", "Faces, and planes that cannot serve", "/**"),
        tab("Faces alone", "Faces", "/faces/**", "/track/**"),
    )


def _blueprint(*tabs: Any, timeline: str = "iteration") -> Any:
    import rerun.blueprint as rrb

    panel = rrb.TimePanel(timeline=timeline, state="collapsed", fps=3.0)
    return rrb.Blueprint(rrb.Tabs(*tabs, active_tab=0), panel, collapse_panels=True)


def _scene_of(name: str, *contents: str, eye: Any = None) -> Any:
    import rerun.blueprint as rrb

    shown = [f"+ {path}" for path in contents]
    return rrb.Spatial3DView(origin="/", contents=shown, name=name, background=PAPER, eye_controls=eye)


def _eye(model: TargetModel) -> Any:
    """Return a viewpoint in front of the target, to the south and above; its distance suits a view as high as wide."""
    import rerun.blueprint as rrb

    corners = np.concatenate([face.vertices_m for face in model.faces])
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle = (low + high) / 2
    away = DISTANCE * float(np.linalg.norm(high - low)) / 2
    where = middle + away * np.array(FROM) / np.linalg.norm(FROM)
    return rrb.EyeControls3D(position=where.tolist(), look_target=middle.tolist(), eye_up=(0, 0, 1))


def _curves(origin: str, name: str) -> Any:
    import rerun.blueprint as rrb
    from rerun import TimeRange, TimeRangeBoundary

    whole = rrb.TimeAxis(view_range=TimeRange(TimeRangeBoundary.infinite(), TimeRangeBoundary.infinite()))
    return rrb.TimeSeriesView(origin=origin, name=name, axis_x=whole, plot_legend=rrb.Corner2D.RightTop)


def _words(origin: str, name: str) -> Any:
    import rerun.blueprint as rrb

    return rrb.TextDocumentView(origin=origin, name=name)
