"""Recordings for the Rerun viewer: RUN/<stage>/<stage>.rrd, drawn from the run's files after the stage.

Each stage has a module in this package with a function ``log(recording, tables)``. All recordings of a run have the
same application id and recording id. Opened together, they are therefore one scene. These are the entities, in the
frame ``target`` unless another is named. Entities with * are thinned: one in ``one_in`` points is in the recording.

    /pool                              entities in the pool frame; segment: the transform from there to ``target``
    /pool/trajectory/pass_<n>          georeference: track of the INS
    /pool/laser *, /pool/soundings *   georeference: points near the target, soundings with the coarse mount
    /target/model/<family>             segment: outlines of the faces by design
    /target/laser/<family> *           segment: labelled laser points
    /planes/<sensor>/<family>          fit_planes: outlines of the fitted planes, of what each sensor sees; normals
    /before/<family> *, /after/<family> *   adjust: soundings with the coarse and with the calibrated mount
    /residuals/<sensor>/<family> *     adjust: points by distance from the adjusted surface
    /maps/<sensor>/<family>            adjust: mean residual of each cell of the faces
    /fans/<sensor>/pass_<n>            adjust: rays of one epoch in the middle of the pass
    /boat/pass_<n>                     adjust: the boat, the INS's axes, scanner and head at that epoch
    /tables/<name>                     text and numbers

Entities over the steps of the timeline ``iteration``:

    /iteration/soundings/<family> *, /iteration/planes/<family>, /iteration/normals/<sensor>   angle_iterate
    /replay/<family> *                                             adjust: soundings from coarse to calibrated
    /curves/deviation/<axis>, /curves/planes/<family>              angle_iterate: degrees
    /curves/turns/<angles or offsets>                              offsets: change in each turn of the alternation

Entities over the timeline ``time`` (UTC):

    /quality/attitude/<axis>                                       ingest: degrees
    /quality/points/<sensor>, /quality/residual/<sensor>/<family>  adjust: points in a second, their mean residual, mm
"""

import re
import uuid
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from pipeline.errors import ArtefactError
from pipeline.language.chosen import in_english
from pipeline.run.results import Tables, agreeing, recording_path
from pipeline.run.settings import read_settings
from pipeline.target.design import target_of
from stages import ORDER, names_in

APPLICATION = "poolcal"
DRAWN = ORDER  # stages that have a recording
MOST_POINTS = 300_000  # most points in a cloud: dense enough to see, few enough for any laptop
COLOURS = {  # that colour-blind readers can tell apart
    "P1": (0, 114, 178), "P2": (230, 159, 0), "P3": (0, 158, 115), "H": (204, 121, 167),
    "other": (122, 92, 0), "more": (60, 60, 60),
}
GREY, SONAR, LASER = (150, 155, 165), (213, 94, 0), (0, 114, 178)
DOT_M = 0.008  # radius of a point


def record(run: Path, stage: str, tabs: Sequence[str]) -> bytes:
    """Return a stage's recording as the content of its file.

    Parameters
    ----------
    run
        The run folder.
    stage
        The stage's name.
    tabs
        The tabs of :mod:`stages.views.blueprint` that the viewer shows.
    """
    from stages.views.blueprint import run_blueprint

    model = target_of(read_settings(run).pool.target)
    layout = run_blueprint(tabs, model)
    return recording_content(recording_id(run), layout, lambda recording: log_stage(recording, stage, Tables(run)))


def log_stage(recording: Any, stage: str, tables: Tables) -> None:
    """Log the entities of a stage into a recording.

    Parameters
    ----------
    recording
        The rerun recording stream.
    stage
        The stage's name.
    tables
        The run's tables.
    """
    import_module(f"stages.views.{stage}").log(recording, tables)


def log_curve(recording: Any, path: str, style: Any, times: Callable[[], Any], values: Any) -> None:
    """Log a curve over a timeline. Without values nothing is logged.

    From columns without rows the viewer makes a timeline of infinite length, and crashes.

    Parameters
    ----------
    recording
        The rerun recording stream.
    path
        The curve's entity.
    style
        The curve's rerun archetype: lines or points.
    times
        Returns the curve's rerun.TimeColumn.
    values
        The curve's values, (n,).
    """
    import rerun as rr

    if len(values):
        recording.log(path, style, static=True)
        recording.send_columns(path, indexes=[times()], columns=rr.Scalars.columns(scalars=values))


def text_document(text: str) -> Any:
    """Return text as a document in fixed-width letters: a code block with a fence longer than any run of ` in it."""
    import rerun

    longest = max((len(run) for run in re.findall("`+", text)), default=0)
    fence = "`" * max(3, longest + 1)
    return rerun.TextDocument(f"{fence}text\n{text}\n{fence}", media_type=rerun.MediaType.MARKDOWN)


def recording_content(identity: str, blueprint: Any, draw: Callable[[Any], None]) -> bytes:
    """Return the content of a recording's file.

    The SDK itself does not write the file: on a full disk it hangs or leaves an incomplete file.

    Parameters
    ----------
    identity
        The recording's id.
    blueprint
        The layout of the viewer.
    draw
        Logs everything into the recording stream.
    """
    import rerun

    recording = rerun.RecordingStream(APPLICATION, recording_id=identity, send_properties=False)
    memory = recording.memory_recording()
    recording.send_blueprint(blueprint, make_active=False, make_default=True)
    with in_english():
        draw(recording)
    recording.flush()
    return bytes(memory.drain_as_bytes())


def recordings_of(run: Path, stage: str | None = None) -> list[Path]:
    """Return the files of a run's recordings, in order, from all stages that agree; or the file of one ``stage``."""
    wanted = agreeing(run, names_in(run)) if stage is None else (stage,)
    paths = [path for name in wanted if (path := recording_path(run, name)).is_file()]
    if not paths:
        raise ArtefactError(f"{run}: has no recording{'' if stage is None else f' of {stage}'}; run poolcal run first")
    return paths


def recording_id(*runs: Path) -> str:
    """Return the id of a run folder's recordings, or of a recording of two runs."""
    return str(uuid.uuid5(uuid.NAMESPACE_URL, "\n".join(run.resolve().as_uri() for run in runs)))
