"""Commands for the time before a calibration."""

from pathlib import Path
from typing import Annotated

import typer

from pipeline.errors import ConfigError
from stages.cli.application import app
from stages.cli.arguments import POOL_FILE, AsJson, Jobs, Pool, Session, SessionYaml


@app.command("init")
def _init(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="folder with the raw files, of one session")],
    pool: Annotated[
        Path | None, typer.Option("--pool", metavar="FILE", help="pool's config to write; default: FOLDER/pool.yaml")
    ] = None,
    with_pool: Annotated[bool, typer.Option("--with-pool/--no-pool", help="write a pool's config as well")] = True,
) -> int:
    """Begin a session: write session.yaml from the raw files.

    What only a person knows is marked FILL_IN there, and listed. No file is replaced.
    """
    from stages.commands import init

    return init.command(folder, pool, with_pool)


@app.command("check")
def _check(
    session: Session,
    config: Annotated[Path | None, typer.Option("--config", metavar="CONFIG", help=f"{POOL_FILE}: where it is")] = None,
    as_json: AsJson = False,
) -> int:
    """Look into a session's files before calibrating, in seconds. Status 1 if something is wrong."""
    from stages.commands import check

    return check.command(session, config, as_json)


@app.command("target")
def _target(
    session: Session,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="write a pool's config with them")] = None,
    html: Annotated[Path | None, typer.Option("--html", metavar="FILE", help="a page with pictures of them")] = None,
    rrd: Annotated[Path | None, typer.Option("--rrd", metavar="FILE", help="write a recording of them")] = None,
    depth: Annotated[
        float | None, typer.Option("--depth", metavar="M", help="depth of the water at the wall; default: 4")
    ] = None,
    bottom: Annotated[
        Path | None,
        typer.Option("--bottom", metavar="RUN", help="a run of this session: find flat pieces of the bottom with it"),
    ] = None,
    jobs: Jobs = None,
) -> int:
    """Find walls and slopes that can serve as a target, in the laser's points."""
    if bottom is not None:
        from stages.commands import target_bottom

        for option, given in (("--depth", depth), ("--html", html), ("--rrd", rrd)):
            if given is not None:
                raise ConfigError(f"{option} {given}: not with --bottom, which takes the run's faces; leave it out")
        return target_bottom.command(session, bottom, out, jobs)
    from stages.commands import target

    return target.command(session, target.TargetOutputs(out, html, rrd), depth, jobs)


@app.command("plan")
def _plan(
    file: Annotated[Path, typer.Argument(metavar="PLAN", help="YAML file of the plan; keys: docs/before-sailing.md")],
    session: SessionYaml,
    config: Pool,
    out: Annotated[Path | None, typer.Option("--yaml", metavar="FILE", help="write the prediction as YAML")] = None,
    rrd: Annotated[Path | None, typer.Option("--rrd", metavar="FILE", help="write a recording of it")] = None,
) -> int:
    """Predict what passes will give, before any data, and choose better ones. Status 1 if they will not do."""
    from stages.commands import plan

    return plan.command(file, session, config, out, rrd)


@app.command("coarse")
def _coarse(
    file: Annotated[Path, typer.Argument(metavar="MARKS", help="YAML file: marks as surveyed, and as drawn")],
    session: SessionYaml,
    out: Annotated[Path | None, typer.Option("--yaml", metavar="FILE", help="write all of it as YAML")] = None,
    write: Annotated[bool, typer.Option("--write/--no-write", help="put the mounts into session.yaml")] = True,
) -> int:
    """Find coarse mounts from a survey of marks on bracket and instruments. Status 1 if the marks do not agree."""
    from stages.commands import coarse

    return coarse.command(file, session, out, write)


@app.command("patch")
def _patch(
    session: Session,
    run: Annotated[
        Path | None, typer.Option("--run", metavar="RUN", help="a run of this boat: does its mount agree?")
    ] = None,
    water_height: Annotated[
        float | None, typer.Option("--water-height", metavar="M", help="height of the water in the INS's datum")
    ] = None,
    jobs: Jobs = None,
) -> int:
    """Find the sonar's angles from passes over the bottom alone: a patch test. Status 1 if they are in doubt."""
    from stages.commands import patch

    return patch.command(session, run, water_height, jobs)
