"""The answer of a check in words and as JSON."""

import textwrap
from collections.abc import Iterator
from typing import Any

import numpy as np

from pipeline.console import plural, signed
from pipeline.entry_check.answer import TOLERANCE_DEG, TOLERANCE_M, Answer
from pipeline.entry_check.check import EntryCheck
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.mount import Mounted, setting_change
from pipeline.text_table import text_table

WIDTH = 100
SCATTER_M = 0.01
VERTICAL = "z"


def verdict_of(answer: Answer) -> str:
    """Return right, wrong, undecidable or uncertain."""
    if not answer.certain:
        return "uncertain"
    if answer.is_right:
        return "right"
    return "undecidable" if len(answer.explanations) > 1 else "wrong"


def check_text(check: EntryCheck) -> str:
    """Return the answer as text for the screen."""
    lines = [line for text in _answer(check) for line in textwrap.wrap(text, WIDTH, subsequent_indent="  ")]
    lines += ["", *_table(check), ""]
    lines += [line for text in _basis(check) for line in textwrap.wrap(text, WIDTH)]
    return "\n".join(lines)


def _answer(check: EntryCheck) -> Iterator[str]:
    answer, verdict = check.answer, verdict_of(check.answer)
    if verdict == "uncertain":
        yield "Cannot be told: the soundings determine the entered mount too poorly. Export more, with 3 decimals."
        return
    if verdict == "right":
        judged = np.array(answer.way.judged)
        but = "" if judged.all() else " (z not judged: the heights are above another surface)"
        most_mm = 1000 * float(np.abs(answer.lever_m[judged]).max())
        yield f"Entered rightly: within {max(most_mm, 0.1):.1f} mm, {max(answer.angle_deg, 0.001):.3f}°{but}."
        return
    if verdict == "undecidable":
        yield "Not entered rightly. These mistakes give the same numbers, and the soundings cannot tell which it was:"
        yield from (f"  - {'; '.join(one.words)}" for one in answer.explanations)
        return
    if answer.explanations:
        yield f"Not entered rightly: {'; '.join(answer.explanations[0].words)}."
        return
    yield from _unexplained(answer)


def _unexplained(answer: Answer) -> Iterator[str]:
    if answer.rotation_right:
        x, y, z = (signed(value, 3) for value in answer.lever_m)
        yield (
            f"Not entered rightly: the angles are right, but the lever arm is off by x {x}, y {y}, z {z} m (starboard, "
            "forward, up), and no known mistake explains it."
        )
        yield (
            "It may be counted from another point than the INS's; or all positions are shifted so (another datum, or "
            "the INS's own lever arm): passes of one heading cannot tell these apart."
        )
    else:
        what = "the lever arm is right, but the angles are" if answer.lever_right else "angles and lever arm are"
        yield f"Not entered rightly: {what} off, and no known mistake explains it. Compare the numbers one by one:"


def _rows(check: EntryCheck) -> Iterator[tuple[str, str, float, float, float, float, bool]]:
    """Yield name, unit, calibrated and found value, difference, sigma of each setting, and whether it is judged."""
    fitted, total = check.answer.way.fitted, check.source.total
    found = Mounted(fitted.R_body_from_mbes, fitted.lever_arm_m)
    wanted, values, sigmas = total.settings(), found.settings(), found.sigmas(fitted.covariance[:6, :6])
    for name, _, key, unit in PARAMETERS:
        judged = name not in "xyz" or check.answer.way.judged["xyz".index(name)]
        yield name, unit, wanted[key], values[key], setting_change(values, wanted, key), sigmas[key], judged


def _table(check: EntryCheck) -> list[str]:
    rows = []
    for name, unit, wanted, found, difference, sigma, judged in _rows(check):
        digits, mark = (4, "°") if unit == "deg" else (4, "m")
        shown = [f"{found:.{digits}f}", signed(difference, digits), f"{sigma:.{digits}f}"] if judged else ["-"] * 3
        rows.append([name, f"{wanted:.{digits}f}", *shown, mark])
    return text_table("<6>12>12>12>10 <2", ["mount", "calibrated", "found", "difference", "sigma", ""], rows)


def _basis(check: EntryCheck) -> Iterator[str]:
    pairs, file, fitted = check.pairs, check.file, check.answer.way.fitted
    yield (
        f"{len(file.points.row):,} of the file's {file.rows:,} soundings lie near the track; {pairs.found:,} of "
        f"the run's {len(check.run.soundings.t_ns):,} that were taken were found again among them "
        f"({100 * pairs.share:.0f} %; by chance {100 * pairs.chance:.1f} %)."
    )
    swapped = ", first coordinate north" if file.placing.swapped else ""
    yield f"CRS: {file.placing.name} ({file.placing.title}){swapped}; heights {'down' if pairs.negated else 'up'}."
    yield (
        f"Scatter of the found soundings: {1000 * fitted.scatter_m:.1f} mm in each coordinate; tolerance "
        f"{TOLERANCE_DEG:g}° and {1000 * TOLERANCE_M:g} mm, and three sigmas."
    )
    if fitted.scatter_m > SCATTER_M:
        yield (
            "So much is no rounding: the software traces rays otherwise, with another sound speed or cast, or it has "
            "other positions and attitudes than the run."
        )
    if check.heights_differ:
        yield "Heights are above another surface than the ellipsoid: z was not judged. Ellipsoidal heights would do."
    if file.lost:
        yield f"Left out: {plural(file.lost, 'row')} without three numbers."


def check_json(check: EntryCheck) -> dict[str, Any]:
    """Return the answer for programs."""
    answer, pairs, file = check.answer, check.pairs, check.file
    return {
        "schema": 1,
        "session": check.run.session,
        "answer": verdict_of(answer),
        "explanations": [{"codes": list(one.keys), "words": list(one.words)} for one in answer.explanations],
        "parameters": [
            dict(zip(("parameter", "unit", "calibrated", "found", "difference", "sigma", "judged"), row, strict=True))
            for row in _rows(check)
        ],
        "difference_deg": answer.angle_deg,
        "difference_m": [float(value) for value in answer.lever_m],
        "rotation_right": answer.rotation_right,
        "lever_arm_right": answer.lever_right,
        "scatter_m": answer.way.fitted.scatter_m,
        "crs": file.placing.name,
        "swapped": file.placing.swapped,
        "found_by": pairs.how,
        "found": pairs.found,
        "share": pairs.share,
        "chance": pairs.chance,
        "rows": file.rows,
    }
