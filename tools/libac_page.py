"""Write the figures of docs/accuracy/real-laser-rows.md: the laser part of the program on real rows of LibAC.

The data are no part of the program. The folder of real files is the argument, or POOLCAL_DATA. Each table replaces the
one between the marks of its name in the page; the words of the page are written by hand, and tests/real tests what they
say.

    python -m tools.libac_page [FOLDER] [--page docs/accuracy/real-laser-rows.md]
"""

import argparse
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.config.verdict import VerdictLimits
from pipeline.finding.dry_planes import dry_planes
from pipeline.limits.verdict_limits import limits_by_setting, limits_of
from pipeline.maths.mount_parameters import PARAMETERS
from tools.libac_closing import GROUPS, SPHERES, Closings
from tools.libac_results import Case, Results, neighbours, results_of
from tools.libac_rows import PASSES

PAGE = Path("docs/accuracy/real-laser-rows.md")
DEFAULT = Path("../shared/data")


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown; the first column is text, the others are figures."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def _mm(value_m: float, digits: int = 0) -> str:
    return f"{1000 * value_m:.{digits}f}"


def _all_mm(values_m: NDArray[np.float64], digits: int = 0) -> str:
    return ", ".join(_mm(value, digits) for value in values_m)


def _rows(found: Results) -> str:
    head = ("target, pass", "rows", "lines", "ms", "range m", "heading °", "speed m/s", "σ of the INS: x, y, z mm")
    body = []
    for (target, number), rows in found.rows.items():
        heading = np.degrees(np.arctan2(*rows.track[0, :2])) % 360
        counts = f"{len(rows)}", f"{len(rows.line_starts)}", _mm(rows.seconds)
        motion = f"{rows.range_m:.1f}", f"{heading:.1f}", f"{np.linalg.norm(rows.velocity_m_s):.2f}"
        body.append((f"{target}, {number}", *counts, *motion, _all_mm(rows.position_sigma_m.mean(axis=0), 1)))
    return table(head, body)


def _placing(found: Results) -> str:
    rows = [("as the conventions say", _mm(found.placed_apart_m, 3))]
    rows += [(f"the sign of {name} reversed", _mm(apart)) for name, apart in found.reversed_m.items()]
    return table(("attitude", "largest distance from LibAC's point mm"), rows)


def _planes(found: Results) -> str:
    head = ("target, pass", "planes, own limits", "planes, small limits", "their points", "width × height mm", "RMS mm",
            "uneven mm", "σ of the normal °", "correlation")  # fmt: skip
    body = []
    for (target, number), rows in found.rows.items():
        own = dry_planes(rows.in_level(found.cases[0].coarse), rows.position_m.mean(axis=0))
        small = found.planes[target, number]
        cells = [f"{target}, {number}", f"{len(own)}", f"{len(small)}", *[""] * (len(head) - 3)]
        for one in small[:1]:
            size = f"{_mm(one.flat.width_m)} × {_mm(one.flat.height_m)}"
            cells[3:5] = f"{len(one.rows)} of {len(rows)}", size
            cells[5:7] = _mm(one.plane.rms_m, 1), _mm(one.flat.uneven_m, 1)
            cells[7:] = f"{one.turn_sigma_deg:.2f}", f"{neighbours(rows, one):.2f}"
        body.append(cells)
    return table(head, body)


def _spheres(found: Results) -> str:
    head = ("target, pass", "radius mm", "RMS mm", "RMS with the radius that the script gives mm")
    body = []
    for (name, number), sphere in found.spheres.items():
        given = found.cases[0].before.spheres[name][PASSES.index(number)]
        body.append((f"{name}, {number}", _mm(sphere.radius_m), _mm(sphere.rms_m, 1), _mm(given.rms_m, 1)))
    return table(head, body)


def _mounts(found: Results) -> str:
    by_number = [key for *_, key, _ in PARAMETERS]

    def line(words: str, values: dict[str, float]) -> tuple[str, ...]:
        figures = (f"{values[key]:.3f}" if key.endswith("_deg") else _mm(values[key], 1) for key in by_number)
        return words, *figures

    body = []
    for case in found.cases:
        after = case.adjusted
        body += [line(case.words, case.coarse.settings()), line("its σ, assumed", case.coarse.sigmas(after.coarse))]
        body += [line(f"{case.words}, adjusted", after.mount.settings())]
        body += [line("its σ", after.mount.sigmas(after.covariance))]
    body.append(line("largest σ of an accepted run", limits_by_setting(limits_of(VerdictLimits(), "laser"))))
    return table(("mount", *(f"{name} {'°' if unit == 'deg' else 'mm'}" for name, _, _, unit in PARAMETERS)), body)


def _closings(found: Results) -> str:
    head = ("mount", "plane: angle °", "lean °", "distance mm", *(f"{name}: along, across, up mm" for name in SPHERES))

    def line(words: str, at: Closings) -> tuple[str, ...]:
        angle = f"{at.plane.angle_deg:.1f} ± {at.plane.angle_sigma_deg:.1f}"
        plane = angle, f"{at.plane.lean_deg:.1f}", _mm(at.plane.distance_m, 1)
        return words, *plane, *(_all_mm(at.of_sphere(name)) for name in SPHERES)

    both = [(case.words, case.before, case.after) for case in found.cases]
    body = [(line(words, before), line(f"{words}, adjusted", after)) for words, before, after in both]
    return table(head, [one for pair in body for one in pair])


def _explained(found: Results) -> str:
    def line(case: Case) -> tuple[str, ...]:
        return case.words, *(f"{case.explanation.squares(places):.1f}" for places in GROUPS.values())

    head = ("mount", *(f"{name}, {len(places)}" for name, places in GROUPS.items()))
    return table(head, map(line, found.cases))


def _told(found: Results) -> str:
    head = ("", *(case.words for case in found.cases))
    body = [(f"direction {k + 1}: σ after ÷ σ before", *(f"{case.adjusted.shares[k]:.3f}" for case in found.cases))
            for k in range(6)]  # fmt: skip
    body.append(("roll by the points alone, less LibAC's, in its σ", *(f"{value:.1f}" for value in found.roll_sigmas)))
    by_roll = (case.explanation.up_by_roll_m for case in found.cases)
    body.append(("heights of the spheres by 0.1° of roll mm", *(_mm(value) for value in by_roll)))
    return table(head, body)


BLOCKS = {
    "rows": _rows,
    "placing": _placing,
    "planes": _planes,
    "spheres": _spheres,
    "mounts": _mounts,
    "closings": _closings,
    "explained": _explained,
    "told": _told,
}


def with_figures(page: str, found: Results) -> str:
    """Return the page with each table made anew."""
    for name, made in BLOCKS.items():
        start, end = f"<!-- {name} -->\n", f"<!-- /{name} -->\n"
        before, after = page.split(start)
        page = f"{before}{start}{made(found)}{end}{after.split(end)[1]}"
    return page


def main() -> None:
    """Write the figures into the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    folder = Path(os.environ.get("POOLCAL_DATA") or DEFAULT)
    parser.add_argument("folder", type=Path, nargs="?", default=folder, help=f"folder of real files; default: {folder}")
    parser.add_argument("--page", type=Path, default=PAGE, help=f"page whose figures are written; default: {PAGE}")
    options = parser.parse_args()
    text = with_figures(options.page.read_text(encoding="utf-8"), results_of(options.folder))
    options.page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
