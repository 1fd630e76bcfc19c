"""The answer of a check in words and as JSON."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from pipeline.console import plural, signed
from pipeline.entry_check.answer import EVEN, Answer
from pipeline.entry_check.check import EntryCheck
from pipeline.entry_check.explanations import Explanation
from pipeline.entry_check.judging import TOLERANCE_DEG, TOLERANCE_M
from pipeline.exports.reading import ROLES
from pipeline.exports.target import Target
from pipeline.language.chosen import translated
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.mount import Mounted, setting_change
from pipeline.text_table import text_table, wrapped

BULLET = "  - "
COARSE_M = 0.002
TELLS_DEG, TELLS_M = 5.0, 0.5  # beyond, an answer excludes nothing that anybody would enter
OTHER_SIGNS = (
    "These are poolcal's signs; your program may have others: add --to NAME, such as qimera, to see both values in its "
    "own (poolcal export --list shows the names)."
)
SHOWN_EXCESS_M = 0.002  # a smaller scatter beyond rounding is not worth a word


def check_text(check: EntryCheck, program: Target | None) -> str:
    """Return the answer as text for the screen; ``program``: in whose signs the values are shown as well."""
    lines = [line for text in _answer(check) for line in _wrapped(text, "  ")]
    lines += ["", *_table(check), ""]
    if program is not None:
        lines += [*_table_of(program, check), ""]
    elif check.answer.verdict in ("wrong", "undecidable"):
        lines += [*_wrapped(OTHER_SIGNS, ""), ""]
    lines += [line for text in _basis(check) for line in _wrapped(text, "")]
    return "\n".join(lines)


def _wrapped(text: str, indent: str) -> list[str]:
    """Return a sentence in lines, in the language of this process."""
    if text.startswith(BULLET):
        return wrapped(text.removeprefix(BULLET), BULLET, " " * len(BULLET))
    return wrapped(text, following=indent)


def _joined(explanation: Explanation) -> str:
    return "; ".join(explanation.words)


def _answer(check: EntryCheck) -> Iterator[str]:
    answer = check.answer
    said = [_joined(one) for one in answer.explanations]
    if answer.verdict == "right":
        yield f"Entered rightly: within {_within(answer)}."
    elif answer.verdict == "right_but" and len(said) == 1:
        yield f"Entered rightly, but {said[0]}."
    elif answer.verdict == "right_but":
        yield "Entered rightly, but one of these is wrong, and the soundings cannot tell which:"
        yield from (BULLET + words for words in said)
    elif answer.verdict == "wrong":
        yield f"Not entered rightly: {said[0]}."
    elif answer.verdict == "uncertain":
        yield from _uncertain(check)
    elif any(one.mount_is_right for one in answer.explanations):
        yield "Cannot be told: either was the mount entered wrongly, or it is right and something else is wrong:"
        yield from (BULLET + words for words in said)
    else:
        yield "Not entered rightly. These mistakes give the same numbers, and the soundings cannot tell which it was:"
        yield from (BULLET + words for words in said)
    yield from _about_z(answer)
    if answer.excess_m > SHOWN_EXCESS_M:
        yield (
            f"The soundings scatter by {1000 * answer.excess_m:.0f} mm beyond rounding. The software traces rays "
            "otherwise (another sound speed or cast), it has other positions or attitudes than the run, its soundings "
            "were smoothed, or not all were placed with the same mount."
        )


def _within(answer: Answer) -> str:
    judged = slice(0, 2) if answer.way.any_height else slice(0, 3)
    most_mm = 1000 * float(np.abs(answer.lever_m[judged]).max())
    return f"{max(most_mm, 0.1):.1f} mm, {max(answer.angle_deg, 0.001):.3f}°"


def _uncertain(check: EntryCheck) -> Iterator[str]:
    answer = check.answer
    most_deg = answer.angle_deg + answer.angle_limit_deg
    most_m = float((np.abs(answer.lever_m) + answer.lever_limit_m)[: 2 if answer.way.any_height else 3].max())
    if check.pairs.evenness < EVEN:
        yield "Cannot be told: the calibrated mount explains the soundings that were found, but not all were."
    elif most_deg > TELLS_DEG or most_m > TELLS_M:
        yield "Cannot be told: the soundings that were found are too few, or scatter too much."
    else:
        yield (
            "Cannot be told closely enough: the calibrated mount explains the soundings, but so does any other within "
            f"{most_deg:.3f}° and {most_m:.3f} m. A larger mistake is excluded."
        )
    if answer.explanations[0].words:
        yield f"Besides: {_joined(answer.explanations[0])}."
    if check.pairs.evenness < EVEN:
        yield (
            "Of some passes hardly any sounding was found: they are missing in the file, or another mount placed them. "
            "Export all in the order of time."
        )
    elif check.file.points.rounding_m > COARSE_M:
        yield "The file rounds its places to a centimetre or more: export text with 3 decimals."
    elif answer.excess_m <= SHOWN_EXCESS_M:
        yield "Export more soundings, of all passes."


def _about_z(answer: Answer) -> Iterator[str]:
    """Yield how well z is known where a shift of all heights is free."""
    if answer.way.any_height and answer.verdict in ("right", "right_but", "uncertain"):
        within_m = abs(float(answer.lever_m[2])) + float(answer.lever_limit_m[2])
        yield (
            f"z is known to {within_m:.3f} m only: the heights are above another surface, and roll and pitch alone "
            "tell z from it."
        )


def _rows(check: EntryCheck) -> Iterator[tuple[str, str, float, float, float, float]]:
    """Yield name, unit, calibrated and found value, difference and sigma of each setting."""
    fitted, found = check.answer.way.fitted, _found(check)
    wanted, values = check.source.total.settings(), found.settings()
    sigmas = found.sigmas(fitted.covariance[:6, :6])
    for name, _, key, unit in PARAMETERS:
        yield name, unit, wanted[key], values[key], setting_change(values, wanted, key), sigmas[key]


def _table(check: EntryCheck) -> list[str]:
    rows = []
    for name, unit, wanted, found, difference, sigma in _rows(check):
        mark = "°" if unit == "deg" else "m"
        rows.append([name, f"{wanted:.4f}", f"{found:.4f}", signed(difference, 4), f"{sigma:.4f}", mark])
    return text_table("<6>12>12>12>10 <2", ["mount", "calibrated", "found", "difference", "sigma", ""], rows)


def _table_of(program: Target, check: EntryCheck) -> list[str]:
    """Return the same values as the program has them; with an order of rotations that is not known, as on its sheet."""
    convention, senses = program.convention, program.convention.words()
    wanted, found = (convention.numbers(one).by_role() for one in (check.source.total, _found(check)))
    rows = []
    for role in ROLES:
        unit = "m" if role in ("x", "y", "z") else "°"
        name = f"{translated(role)} ({translated(senses[role])})"
        rows.append([name, f"{wanted[role]:.4f}", f"{found[role]:.4f}", unit])
    title = f"In the signs of {program.title}, positions from the INS:"
    return [*_wrapped(title, ""), *text_table("<6>12>12 <2", ["", "to be entered", "found", ""], rows)]


def _found(check: EntryCheck) -> Mounted:
    fitted = check.answer.way.fitted
    return Mounted(fitted.R_body_from_mbes, fitted.lever_arm_m)


def _basis(check: EntryCheck) -> Iterator[str]:
    pairs, file, fitted = check.pairs, check.file, check.answer.way.fitted
    taken = f", of which {len(file.points.row):,} were taken" if len(file.points.row) < file.near else ""
    yield (
        f"{file.near:,} of the file's {file.rows:,} soundings lie near the track{taken}; {pairs.found:,} of "
        f"the run's {len(check.run.soundings.t_ns):,} that were taken were found again among them "
        f"({100 * pairs.share:.0f} %; by chance {100 * pairs.chance:.1f} %)."
    )
    swapped = ", first coordinate north" if file.placing.swapped else ""
    yield f"CRS: {file.placing.name} ({file.placing.title}){swapped}; heights {'down' if pairs.negated else 'up'}."
    yield (
        f"Scatter of the found soundings: {1000 * fitted.scatter_m:.1f} mm in each coordinate; tolerance "
        f"{TOLERANCE_DEG:g}° and {1000 * TOLERANCE_M:g} mm, and three sigmas."
    )
    if file.lost:
        yield f"Left out: {plural(file.lost, 'row')} without three numbers."


def check_json(check: EntryCheck) -> dict[str, Any]:
    """Return the answer for programs."""
    answer, pairs, file = check.answer, check.pairs, check.file
    return {
        "schema": 1,
        "session": check.run.session,
        "answer": answer.verdict,
        "explanations": [{"codes": list(one.keys), "words": list(one.words)} for one in answer.explanations],
        "parameters": [
            dict(zip(("parameter", "unit", "calibrated", "found", "difference", "sigma"), row, strict=True))
            for row in _rows(check)
        ],
        "difference_deg": answer.angle_deg,
        "difference_m": [float(value) for value in answer.lever_m],
        "limit_deg": answer.angle_limit_deg,
        "limit_m": [float(value) for value in answer.lever_limit_m],
        "other_heights": answer.way.any_height,
        "rotation_right": answer.rotation_right,
        "lever_arm_right": answer.lever_right,
        "scatter_m": answer.way.fitted.scatter_m,
        "excess_m": answer.excess_m,
        "crs": file.placing.name,
        "swapped": file.placing.swapped,
        "found_by": pairs.how,
        "found": pairs.found,
        "share": pairs.share,
        "chance": pairs.chance,
        "rows": file.rows,
    }
