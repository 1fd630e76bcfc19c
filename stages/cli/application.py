"""The application to which every module of this package adds its commands, and the options of every command."""

import sys
from typing import Annotated

import typer

import pipeline
from pipeline.language.speaking import say
from stages.cli import help_text

help_text.speak()
app = typer.Typer(
    name="poolcal",
    help="Calibrates a boat's multibeam sonar against its laser scanner in a pool.",
    epilog="Exit status: 0 done; 1 done, but the answer is no; 2 bad input or config; 3 a bug in poolcal.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _print_version(asked: bool) -> None:
    if asked:
        say(f"poolcal {pipeline.__version__}", sys.stdout)
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="print the version and end")
    ] = False,
    lang: Annotated[
        str | None, typer.Option("--lang", metavar="CODE", help="language, en or zh; default: the locale's")
    ] = None,
    debug: Annotated[bool, typer.Option("--debug", help="show the traceback of bad input as well")] = False,
) -> None:
    """Options of every command."""
