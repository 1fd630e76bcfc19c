"""Plant mistakes of entry, export soundings by an independent model of a survey software, and ask poolcal check-entry.

Every planted mistake must be named, alone or among those that give the same numbers. Right entries with other CRS,
forms of files, decimals, thinning, outliers and rounded settings must pass. Where the software works otherwise than the
run, a right entry must not be called wrong, nor a wrong one right; nor may one that is wrong by little.

    python -m tools.entry_campaign SESSION RUN [--right 100] [--kind differences] [--only WORDS] [--seed 1]
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np
from pyproj import CRS

from pipeline.entry_check.check import EntryCheck, check_entry
from pipeline.errors import PoolcalError
from pipeline.results.finished_run import FinishedRun
from stages import ORDER
from tools.entry_cases import Planted, differences, near_entries, planted, right_entries
from tools.survey_software import Recording, georeferenced, in_crs, recording, write_points


def exported(folder: Path, recorded: Recording, case: Planted) -> tuple[Path, str]:
    """Write a case's file into a folder; return its path and the CRS."""
    export = case.export
    random = np.random.default_rng(export.seed)
    placed = georeferenced(recorded, case.entry)
    placed = placed[np.flatnonzero(random.random(len(placed)) < export.share)[:: export.every]]
    bad = random.random(len(placed)) < export.outliers
    placed[bad] += random.normal(0, 0.5, (bad.sum(), 3))
    crs = export.crs
    if crs == "utm":
        zone = int((np.degrees(recorded.ins["longitude_rad"][0]) + 180) // 6) + 1
        crs = f"EPSG:{(32600 if recorded.ins['latitude_rad'][0] >= 0 else 32700) + zone}"
    file = folder / f"soundings{export.form}"
    points = in_crs(placed, crs, export.lift_m)
    write_points(file, points, export.decimals, CRS.from_user_input(crs).is_geographic)
    return file, crs


def named(check: EntryCheck) -> str:
    """Return the answer with its codes."""
    codes = [" + ".join(sorted({*one.keys} - {"right", "plain"})) for one in check.answer.explanations]
    return f"{check.answer.verdict} {' | '.join(codes)}".strip()


def row(run: FinishedRun, recorded: Recording, case: Planted) -> tuple[str, str, bool]:
    """Return what was planted, what was named, and whether that is right."""
    with tempfile.TemporaryDirectory() as folder:
        file, crs = exported(Path(folder), recorded, case)
        try:
            check = check_entry(run, file, crs, False)
        except PoolcalError as error:
            return case.words, f"refused: {str(error).partition(': ')[2][:90]}", "refused" in case.verdicts
    found = {code for one in check.answer.explanations for code in one.keys}
    is_named = not case.codes or bool(found & {*case.codes})
    return case.words, named(check), check.answer.verdict in case.verdicts and is_named


def main() -> None:
    """Print a table: planted, named, right or not."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("session", type=Path)
    parser.add_argument("run", type=Path)
    parser.add_argument("--right", type=int, default=100, help="number of right entries; default: 100")
    parser.add_argument("--near", type=int, default=30, help="number of entries wrong by little; default: 30")
    parser.add_argument("--only", default="", help="cases whose words begin so")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", default="", choices=("", "planted", "differences", "right", "near"))
    options = parser.parse_args()
    run, recorded = FinishedRun.read(options.run, ORDER), recording(options.session)
    result = json.loads((options.run / "report" / "calibration.json").read_text(encoding="utf-8"))
    coarse = run.settings.session.sonar.mount.model_dump()
    result["mbes"]["mount_coarse"] = coarse
    rights = right_entries(result, options.right, options.seed)
    kinds = {"planted": planted(result), "differences": differences(result), "right": rights,
             "near": near_entries(result, options.near, options.seed)}  # fmt: skip
    cases = [case for kind, cases in kinds.items() if options.kind in ("", kind) for case in cases]
    good = 0
    chosen = [case for case in cases if case.words.startswith(options.only)]
    for case in chosen:
        words, answer, is_good = row(run, recorded, case)
        good += is_good
        print(f"{'ok ' if is_good else 'BAD'} {words:48} {answer}", flush=True)
    print(f"{good} of {len(chosen)}")


if __name__ == "__main__":
    main()
