"""Recordings for the Rerun viewer: RUN/<stage>/<stage>.rrd, drawn from Parquet alone, after the stage.

A module a stage: ``log(recording, tables)``. All recordings of a run share the application's and the recording's id, so
that opened together they are one scene. Entities (frame target unless said; README, "Recordings"):

    /pool                        what is in the pool frame; a transform, known from stage segment on, places it
    /pool/trajectory/pass_<n>    track of the INS
    /pool/laser, /pool/soundings points near the target, soundings with the coarse mount
    /target/model/<family>       outlines of the faces by design
    /target/laser/<family>       labelled laser points
    /iteration/soundings/<family>, /iteration/normals/{laser,mbes}   on the timeline ``iteration``
    /curves/...                  deviations and steps on the same timeline
"""

import contextlib
import os
import uuid
from importlib import import_module
from pathlib import Path
from typing import Any

from pipeline import folder, manifest
from pipeline.errors import ArtefactError
from pipeline.tables import Tables
from stages import ORDER

APPLICATION = "poolcal"
DRAWN = ("georeference", "segment", "angle_iterate")
AT_MOST = 1_000_000  # points an entity
COLOURS = {"P1": (0, 114, 178), "P2": (230, 159, 0), "P3": (0, 158, 115), "H": (204, 121, 167)}  # for all eyes
GREY, SONAR = (150, 155, 165), (213, 94, 0)
PAPER = (255, 255, 255)


def draw(run: Path) -> list[str]:
    """Draw what is not drawn yet; the names of the stages drawn. A finished result is never touched."""
    with folder.locked(run, ORDER):
        return [stage for stage in DRAWN if manifest.read(run / stage) is not None and _draw(run, stage)]


def _draw(run: Path, stage: str) -> bool:
    path = run / stage / f"{stage}.rrd"
    if path.exists():
        return False
    partial = path.with_suffix(".rrd.partial")
    import rerun

    recording = rerun.RecordingStream(APPLICATION, recording_id=recording_id(run), send_properties=False)
    try:
        recording.save(partial, default_blueprint=_blueprint())
        import_module(f"stages.views.{stage}").log(recording, Tables(run))
        recording.flush()
        recording.disconnect()
        os.replace(partial, path)
    finally:
        with contextlib.suppress(OSError):
            partial.unlink()
    return True


def recordings_of(run: Path, stage: str | None = None) -> list[Path]:
    """The recordings there are, in the stages' order."""
    wanted = ORDER if stage is None else (stage,)
    found = [path for name in wanted if (path := run / name / f"{name}.rrd").is_file()]
    if not found:
        raise ArtefactError(f"{run}: has no recording{'' if stage is None else f' of {stage}'}; run poolcal run first")
    return found


def show(paths: list[Path]) -> int:
    """The viewer, until it is closed; it listens on this machine alone."""
    import subprocess
    import sys

    viewer = Path(sys.executable).with_name("rerun")
    return subprocess.run([viewer, "--bind", "127.0.0.1", *paths], check=False).returncode and 1


def recording_id(run: Path) -> str:
    """One a run folder."""
    return str(uuid.uuid5(uuid.NAMESPACE_URL, run.resolve().as_uri()))


def _blueprint() -> Any:
    """A crew's tour: the scene, and the iteration with its curves."""
    import rerun.blueprint as rrb

    return rrb.Blueprint(
        rrb.Tabs(
            rrb.Spatial3DView(
                origin="/", contents=["+ /pool/**", "+ /target/**"], name="Overview", background=PAPER
            ),
            rrb.Horizontal(
                rrb.Spatial3DView(
                    origin="/", contents=["+ /iteration/**", "+ /target/model/**"], name="Iteration", background=PAPER
                ),
                rrb.TimeSeriesView(origin="/curves", name="Deviations, degrees"),
                column_shares=[3, 2],
                name="Iteration",
            ),
            active_tab=0,
        ),
        rrb.TimePanel(timeline="iteration", state="collapsed", fps=3.0),
        collapse_panels=True,
    )
