"""What was found in a folder, and what is left to be done, for the screen."""

import shlex
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from pipeline import CONFIGS
from pipeline.config.fill_in import Unfilled, what
from pipeline.console import plural
from pipeline.language.chosen import translated
from pipeline.starting.file_groups import FileGroup
from pipeline.starting.folder_survey import FolderSurvey
from pipeline.starting.left_out_words import left_out_lines
from pipeline.starting.span_words import span_words
from pipeline.text_table import text_table

MOST_LINES = 20


def found_text(survey: FolderSurvey) -> str:
    """Return the table of the files by sensor and kind, then files that are not used, and doubts."""
    rows = [_row(group, len(groups) > 1) for groups in survey.groups.values() for group in groups]
    lines = text_table("<6  <20  >5  <46  <12", ["sensor", "kind", "files", "first to last record", "instrument"], rows)
    lines += [f"{sensor}: no file that can be read" for sensor, groups in survey.groups.items() if not groups]
    lines += [f"cast of sound speed: {name}" for name in survey.casts]
    lines += [f"Look: {doubt}" for doubt in survey.doubts]
    if survey.left_out:
        lines += ["", f"Not used: {plural(len(survey.left_out), 'file')}"]
        lines += [f"  {line}" for line in left_out_lines(survey.left_out, MOST_LINES)]
    return "\n".join(lines)


def _row(group: FileGroup, is_choice: bool) -> list[str]:
    kind = f"{group.kind.title}{' (one of several)' if is_choice else ''}"
    return [group.sensor, kind, str(len(group.files)), span_words(group), group.instrument or "not named"]


def steps_text(session: Path, pool: Path | None, open_keys: Sequence[tuple[Path, Sequence[Unfilled]]]) -> str:
    """Return what is left to be done, numbered, with the commands.

    Parameters
    ----------
    session
        The session folder.
    pool
        The pool's config; None: it is not known.
    open_keys
        The files that were written, each with its keys that are still to be filled in.
    """
    mounts = [one for _, missing in open_keys for one in missing if ".mount." in one.key]
    steps = _to_fill_in(open_keys, mounts)
    if mounts:
        sensors = " and ".join(sorted({one.key.partition(".")[0] for one in mounts}))
        steps.append(
            [
                f"The mounts of {sensors}: survey marks, fill in a copy of this file, and let poolcal write them; or "
                "fill them in by hand:",
                shlex.quote(str(CONFIGS / "marks.yaml")),
                command("coarse", "MARKS.yaml", "--session", session),
            ]
        )
    config = pool or "POOL.yaml"
    check = command("check", session, "--config", config)
    run = command("run", session, "--config", config, "--run", "RUN")
    steps += [
        ["See whether the files are good, best while the boat is still in the water:", check],
        ["Calibrate, with verdict and report:", run],
        [
            "Enter the values in the survey's software, and prove that they are right there:",
            command("export", "RUN", "--to", "NAME"),
            command("check-entry", "RUN", "SOUNDINGS"),
        ],
        [
            "Print the certificate (its names: about in session.yaml):",
            command("report", "RUN", "--pdf", "FILE.pdf", "--certificate"),
        ],
    ]
    lines = ["Left to be done:"]
    for number, (words, *below) in enumerate(steps, 1):
        lines += [f"{number}. {translated(words)}", *(f"     {line}" for line in below)]
    return "\n".join(lines)


def _to_fill_in(open_keys: Sequence[tuple[Path, Sequence[Unfilled]]], mounts: Sequence[Unfilled]) -> list[list[str]]:
    """Return a step for each file in which keys other than mounts are open: poolcal coarse needs them filled in."""
    steps: list[list[str]] = []
    for path, missing in open_keys:
        others = [one for one in missing if one not in mounts]
        if others:
            steps.append([f"Fill in {path}:", *_by_block(others)])
    return steps


def _by_block(missing: Sequence[Unfilled]) -> list[str]:
    lines = []
    for block, keys in groupby(missing, lambda one: one.block):
        together = [*keys]
        words = what(together[0].key) if len(together) == 1 else what(block)
        names = ", ".join([together[0].key, *(one.key.rpartition(".")[2] for one in together[1:])])
        lines.append(f"{names}{f': {words}' if words else ''}")
    return lines


def command(*words: object) -> str:
    """Return a command of poolcal as the user would type it; a path cannot be taken for an option."""
    written = [f"./{word}" if isinstance(word, Path) and str(word).startswith("-") else str(word) for word in words]
    return " ".join(["poolcal", *map(shlex.quote, written)])
