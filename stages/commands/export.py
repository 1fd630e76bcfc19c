"""``poolcal export``: the mount of a run in the form of another program, or its points, on the screen or in a file."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

from pipeline.artefacts.catalogue.points import POOL_FRAME
from pipeline.artefacts.catalogue.target import TARGET_POSE
from pipeline.artefacts.from_tables import target_frame
from pipeline.atomic_files import write_text
from pipeline.config.session import Calibrated
from pipeline.console import plural
from pipeline.errors import ConfigError
from pipeline.exports.cloud import CLOUDS, write_cloud
from pipeline.exports.cloud_frame import cloud_frame
from pipeline.exports.cloud_points import CalibratedPoints
from pipeline.exports.mounting import SENSOR_WORDS, Mounting, VesselFrame, vector
from pipeline.exports.registry import list_text, target_named
from pipeline.exports.source import mounting_of
from pipeline.exports.target import Options
from pipeline.exports.writing import export_text
from pipeline.language.speaking import say
from pipeline.mount import Mounted, mount_of
from pipeline.results.finished_run import FinishedRun
from pipeline.run.output_files import refuse_output
from pipeline.run.results import Tables
from pipeline.run.settings import calibrated_in
from stages import names_in

Three = tuple[float, float, float]
WRITTEN = b"poolcal export"  # each file that this command writes holds these words, but for those without comments


@dataclass(frozen=True)
class Choices:
    """Options of the command; None: not given."""

    ins_point: Three | None
    ins_turn: Three | None
    order: str | None
    serial: str | None
    ins_height: float | None
    projector_offset: Three | None
    crs: str | None
    although_rejected: bool
    head: str | None = None  # of a sonar with several


def print_list() -> int:
    """Print a table of all programs."""
    say(list_text(), sys.stdout)
    return 0


def command(run_folder: Path | None, name: str | None, out: Path | None, choices: Choices) -> int:
    """Write the mount, or the points.

    Parameters
    ----------
    run_folder
        The run folder.
    name
        The program.
    out
        The file; None: the screen.
    choices
        Other options.
    """
    if run_folder is None or name is None:
        raise ConfigError("export: give RUN and --to NAME; poolcal export --list shows the names")
    if name not in CLOUDS:
        target_named(name, "--to")
    calibrated = calibrated_in(run_folder)
    run = FinishedRun.read(run_folder, names_in(run_folder), calibrated, several_heads=True)
    if name in CLOUDS:
        if len(run.heads) > 1:
            raise ConfigError(f"--to {name}: {run_folder} has several heads, whose points are not exported together")
        return _export_points(run, name, out, choices)
    target = target_named(name, "--to")
    if target.sensor != "laser":
        run = _of_head(run, choices.head)
    elif choices.head is not None:
        raise ConfigError(f"--head: {name} takes the laser's mount; leave it out")
    if choices.crs is not None:
        raise ConfigError(f"--crs: {name} is a mount, and has no CRS; leave it out")
    refuse_output("--out", out, run_folder, run.settings.session_folder, suffix=target.suffix, holds=WRITTEN)
    mounting = _placed(mounting_of(run, target.sensor, choices.although_rejected), choices)
    text = export_text(target, mounting, Options(choices.order, choices.serial, choices.ins_height))
    if out is None:
        say(text.removesuffix("\n"), sys.stdout, as_is=True)
        return 0
    write_text(out, text)
    sensor = SENSOR_WORDS[mounting.sensor]
    say(f"{out}: the {sensor}'s mount for {target.title}; totals, which replace what stands there", sys.stdout)
    return 0


def _of_head(run: FinishedRun, head: str | None) -> FinishedRun:
    """Return the run of one head of the sonar; with several heads it must be named."""
    if head is None and len(run.heads) > 1:
        raise ConfigError(f"{run.path}: has {len(run.heads)} heads, {' and '.join(run.heads)}: say which, --head NAME")
    if head is not None and head not in run.heads:
        raise ConfigError(f"--head {head!r}: is no head of {run.path}, which has {', '.join(run.heads)}")
    return run.of_head(head or run.heads[0])


def _placed(mounting: Mounting, choices: Choices) -> Mounting:
    """Return the mount in the vessel's frame that the options tell, with the transmitter's place."""
    point = vector(choices.ins_point, "--ins-point", 1000.0)
    turn = vector(choices.ins_turn, "--ins-turn", 360.0)
    placed = replace(mounting, frame=VesselFrame(point, turn))
    if choices.projector_offset is None:
        return placed
    if mounting.sensor != "mbes":
        raise ConfigError("--projector-offset: this is the laser's mount; leave it out")
    return replace(placed, projector_offset_m=vector(choices.projector_offset, "--projector-offset", 100.0))


def _export_points(run: FinishedRun, name: str, out: Path | None, choices: Choices) -> int:
    """Write the calibrated points of both sensors as LAS or LAZ."""
    given = (
        choices.ins_point,
        choices.ins_turn,
        choices.order,
        choices.serial,
        choices.ins_height,
        choices.projector_offset,
    )
    if any(choice is not None for choice in given):
        raise ConfigError(
            f"--to {name}: writes points; of the options only --out, --crs and --although-rejected belong to it"
        )
    if out is None:
        raise ConfigError(f"--to {name}: writes points; name the file: --out FILE.{name}")
    refuse_output("--out", out, run.path, run.settings.session_folder, suffix=f".{name}", holds=WRITTEN)
    mounting = mounting_of(run, None, choices.although_rejected)
    mounts: dict[Calibrated, Mounted] = {"laser": mount_of(run.settings.session.laser.mount)}
    mounts[mounting.sensor] = mounting.body
    tables = Tables(run.path)
    frame = cloud_frame(choices.crs, target_frame(tables.table(TARGET_POSE)), tables.table(POOL_FRAME))
    points = CalibratedPoints.of(tables, mounts, run.settings.pool.as_built.faces)
    number = write_cloud(out, points, frame, mounting.origin)
    say(f"{out}: {plural(number, 'point')} in {frame.name}, with their distances from the target's faces", sys.stdout)
    return 0
