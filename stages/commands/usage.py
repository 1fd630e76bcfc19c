"""No command: this module says what is wrong with a command line, in one line, and what was probably meant."""

import re
from collections.abc import Collection, Sequence
from difflib import get_close_matches
from typing import Any

import typer

INIT = "poolcal init FOLDER writes session.yaml and a pool's config from a folder of raw files"
WANTED = {  # by required option: the words for the message if it is missing
    "--config": "--config FILE: the pool's YAML file, which says where the target is; poolcal init begins one",
    "--run": "--run RUN: the folder for the results, outside the session folder",
    "--session": "--session SESSION: the folder with session.yaml",
}
MEANT = {  # words that other programs have, or that one would try: the commands that do it, the first that there is
    "begin": ("init",), "create": ("init",), "new": ("init",), "setup": ("init",), "start": ("init",),
    "adjust": ("run",), "calibrate": ("run",), "calibration": ("run",), "process": ("run",), "solve": ("run",),
    "patch-test": ("run",), "patchtest": ("run",),
    "inspect": ("check",), "qc": ("check",), "test": ("check",), "validate": ("check",), "survey": ("coarse",),
    "marks": ("coarse",), "boresight": ("laser",), "lidar": ("laser",), "scanner": ("laser",),
    "demo": ("simulate",), "simulation": ("simulate",), "predict": ("plan",), "hash": ("verify",),
    "difference": ("diff",), "moved": ("diff",), "trend": ("history",), "sessions": ("history",),
    "open": ("view",), "show": ("view",), "rerun": ("view",), "recording": ("view",), "recordings": ("view",),
    "convert": ("export",), "save": ("export",), "write": ("export",), "caris": ("export",), "qinsy": ("export",),
    "hypack": ("export",), "sis": ("export",), "compare-entry": ("check-entry",), "entry": ("check-entry", "export"),
}  # fmt: skip


def usage_message(error: typer.TyperException) -> str:
    """Return the message for a wrong command line, with the command that shows the help."""
    context = getattr(error, "ctx", None)
    place = getattr(context, "command_path", "poolcal")
    words = " ".join(error.format_message().split()).rstrip(".")
    unknown = re.match(r"No such command '([^']*)'", words)
    if unknown is not None:
        hint = meant(unknown[1], list(getattr(getattr(context, "command", None), "commands", ())))
        return f"{unknown[0]}; {hint}see {place} --help"
    option = next(iter(getattr(getattr(error, "param", None), "opts", ())), "")
    if words.startswith("Missing option") and option in WANTED:
        words = f"missing: {WANTED[option]}"
    others = [WANTED.get(name, name) for name in _missing_options(context) if name != option]
    if words.lower().startswith("missing") and others:
        words = f"{words}; {'; '.join(others)}; {INIT}"
    return f"{words or 'nothing to do'}; see {place} --help"


def meant(word: str, commands: Collection[str]) -> str:
    """Return a question that names the command which was probably meant; empty if none is like it.

    >>> meant("calibrate", ["run", "diff"]), meant("hisotry", ["run", "history"]), meant("wash", ["run"])
    ('did you mean poolcal run? ', 'did you mean poolcal history? ', '')
    """
    lower = word.lower().replace("_", "-")
    known = [name for name in MEANT.get(lower, ()) if name in commands]
    alike: Sequence[str] = known or get_close_matches(lower, list(commands), 1)
    return f"did you mean poolcal {alike[0]}? " if alike else ""


def _missing_options(context: Any) -> list[str]:
    """Return the required options of a command that were not given.

    The parser takes up given options before it comes to missing ones, and stops at the first that is missing.
    """
    parameters = getattr(getattr(context, "command", None), "params", ())
    taken = getattr(context, "params", {})
    return [
        parameter.opts[0]
        for parameter in parameters
        if parameter.required and parameter.name not in taken and parameter.opts[0].startswith("-")
    ]
