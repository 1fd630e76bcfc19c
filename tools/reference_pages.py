"""Write the pages that are made from the program: commands, reasons by code, the pool's config, conventions.

A test compares them with the program, so that a change of a command or of a reason asks for them anew:

    python -m tools.reference_pages
"""

import contextlib
import io
import os
from pathlib import Path
from unittest import mock

from pipeline.report.reason_codes import ReasonCode
from pipeline.report.remedies import REMEDIES
from stages.cli import call
from stages.cli.application import app

DOCS = Path(__file__).parents[1] / "docs"
COMMANDS = """# Commands

What `poolcal NAME --help` prints. Exit status of every command: 0 done, and the answer is yes; 1 done, but the answer
is no; 2 bad input or config, told in one line; 3 a bug in poolcal. An interruption by Ctrl-C ends with 130.
"""
REASONS = """# Reasons and warnings, by code

calibration.json has `reason_codes` beside `reasons`, and `warning_codes` beside `warnings`: one code each, in the same
order. A code never changes; the words beside it may. A reason rejects; a warning does not. The words in the report and
in calibration.json say what was found in your session; this page says where it mostly comes from, and what to do.
"""
POOL = """# The pool's config

`configs/defaults.yaml`, which has every key with its default and its meaning. Copy it and keep the lines that differ;
the target's `a`, `b`, `c`, `e` and `origin` are required ([The target](../target.md)).
"""


def command_names() -> list[str]:
    """Return the names of all commands, in the order of the help."""
    return [str(command.name) for command in app.registered_commands]


def help_of(*words: str) -> str:
    """Return what a command's ``--help`` prints, in lines of at most 80 letters."""
    shown = io.StringIO()
    with mock.patch.dict(os.environ, COLUMNS="80"), contextlib.redirect_stdout(shown):
        call([*words, "--help"])
    return "\n".join(line.rstrip() for line in shown.getvalue().strip().split("\n"))


def commands_page() -> str:
    """Return docs/reference/commands.md."""
    parts = [COMMANDS, f"```text\n{help_of()}\n```\n"]
    parts += [f"## poolcal {name}\n\n```text\n{help_of(name)}\n```\n" for name in command_names()]
    return "\n".join(parts)


def reasons_page() -> str:
    """Return docs/reference/reasons.md."""
    parts = [REASONS]
    for code in ReasonCode:
        remedy = REMEDIES[code]
        meaning = code.meaning[0].upper() + code.meaning[1:]
        parts.append(
            f"## {code.value}\n\n*{meaning}.*\n\n**Mostly:** {remedy.cause}\n\n**What to do:** {remedy.remedy}\n"
        )
    return "\n".join(parts)


def pool_page() -> str:
    """Return docs/reference/pool.md."""
    return f"{POOL}\n```yaml\n{(DOCS.parent / 'configs' / 'defaults.yaml').read_text(encoding='utf-8')}```\n"


def conventions_page() -> str:
    """Return docs/theory/conventions.md: the repository's CONVENTIONS.md."""
    return (DOCS.parent / "CONVENTIONS.md").read_text(encoding="utf-8")


PAGES = {
    "reference/pool.md": pool_page,
    "reference/commands.md": commands_page,
    "reference/reasons.md": reasons_page,
    "theory/conventions.md": conventions_page,
}


def main() -> None:
    """Write all pages."""
    for name, page in PAGES.items():
        (DOCS / name).write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
