"""Commands for the survey after a calibration: the mount in the forms of other programs and back, and the proof."""

from pathlib import Path
from typing import Annotated

import typer

from stages.cli.application import app
from stages.cli.arguments import AsJson, RunFolder, SessionYaml

Three = tuple[float, float, float]
InsPoint = Annotated[
    Three | None,
    typer.Option(
        "--ins-point", metavar="X Y Z", help="INS from the program's reference point: starboard, forward, up, m"
    ),
]
InsTurn = Annotated[
    Three | None,
    typer.Option(
        "--ins-turn", metavar="ROLL PITCH YAW", help="turn of the INS in the vessel, if the program has one, degrees"
    ),
]
Order = Annotated[
    str | None, typer.Option("--order", metavar="YPR", help="order of rotations, where the maker does not state it")
]
Serial = Annotated[str | None, typer.Option("--serial", metavar="N", help="the sonar's serial number, for kluster")]
InsHeight = Annotated[
    float | None,
    typer.Option("--ins-height", metavar="H", help="height of the INS above the water, m, for hypack, kluster"),
]


@app.command("export")
def _export(
    run_folder: Annotated[
        Path | None, typer.Argument(metavar="RUN", help="run folder, as given to poolcal run")
    ] = None,
    target: Annotated[str | None, typer.Option("--to", metavar="NAME", help="the program; --list shows all")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="file to write; default: the screen")
    ] = None,
    show_list: Annotated[
        bool, typer.Option("--list", help="list all programs, and how sure their conventions are")
    ] = False,
    ins_point: InsPoint = None,
    ins_turn: InsTurn = None,
    order: Order = None,
    serial: Serial = None,
    ins_height: InsHeight = None,
    projector_offset: Annotated[
        Three | None,
        typer.Option("--projector-offset", metavar="X Y Z", help="transmitter from receiver in the sonar's frame, m"),
    ] = None,
    crs: Annotated[
        str | None, typer.Option("--crs", metavar="EPSG:N", help="projected CRS of the points, for las, laz")
    ] = None,
    although_rejected: Annotated[
        bool, typer.Option("--although-rejected", help="export a rejected run too, marked as such")
    ] = False,
    head: Annotated[
        str | None, typer.Option("--head", metavar="NAME", help="of a sonar with several heads: mbes, mbes_2, ...")
    ] = None,
) -> int:
    """Write the mount in another program's form and signs.

    Also the calibrated points as LAS or LAZ (--to las, --to laz). The numbers are totals: they replace what stands in
    the program.
    """
    from stages.commands import export

    if show_list:
        return export.print_list()
    choices = export.Choices(
        ins_point, ins_turn, order, serial, ins_height, projector_offset, crs, although_rejected, head
    )
    return export.command(run_folder, target, out, choices)


@app.command("check-entry")
def _check_entry(
    run_folder: RunFolder,
    soundings: Annotated[
        Path,
        typer.Argument(metavar="SOUNDINGS", help="the session's soundings by the survey software: XYZ, CSV, LAS, GSF"),
    ],
    crs: Annotated[
        str | None,
        typer.Option("--crs", metavar="CRS", help="of the coordinates, such as EPSG:32651; default: what fits"),
    ] = None,
    other_heights: Annotated[
        bool, typer.Option("--other-heights", help="heights are not ellipsoidal: do not judge z")
    ] = False,
    program: Annotated[
        str | None, typer.Option("--to", metavar="NAME", help="show the values in this program's signs, too")
    ] = None,
    as_json: AsJson = False,
) -> int:
    """Check that the mount was entered rightly elsewhere.

    Compares soundings of the same session, as the survey software placed them with the values that were entered into
    it. Status 1 if they were not entered rightly, or if it cannot be told.
    """
    from stages.commands import check_entry

    return check_entry.command(run_folder, soundings, crs, other_heights, program, as_json)


@app.command("mount")
def _mount(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="file of the program, or of poolcal export")],
    source: Annotated[str, typer.Option("--from", metavar="NAME", help="the program; poolcal export --list shows all")],
    session: SessionYaml,
    sensor: Annotated[
        str | None, typer.Option("--sensor", metavar="NAME", help="mbes or laser; default: by the file")
    ] = None,
    ins_point: InsPoint = None,
    ins_turn: InsTurn = None,
    order: Order = None,
    serial: Serial = None,
    ins_height: InsHeight = None,
    write: Annotated[bool, typer.Option("--write/--no-write", help="put the mount into session.yaml")] = True,
) -> int:
    """Read a coarse mount from another program's file."""
    from stages.commands import mount

    options = mount.ReadOptions(sensor, ins_point, ins_turn, order, serial, ins_height)
    return mount.command(file, source, session, options, write)
