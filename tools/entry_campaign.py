"""Plant mistakes of entry, export soundings by an independent model of a survey software, and ask poolcal check-entry.

Every planted mistake must be named, alone or among those that give the same numbers. Right entries with other CRS,
forms of files, decimals, thinning, outliers and rounded settings must pass.

    python -m tools.entry_campaign SESSION RUN [--right 100] [--only WORDS] [--seed 1]
"""

import argparse
import json
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pyproj import CRS

from pipeline.entry_check.check import EntryCheck, check_entry
from pipeline.errors import PoolcalError
from pipeline.results.finished_run import FinishedRun
from stages import ORDER
from tools.survey_software import Entry, Recording, entry_of, georeferenced, in_crs, recording, write_points

FORMS = (".xyz", ".csv", ".las", ".laz")


@dataclass(frozen=True)
class Export:
    """How a file is written; ``utm``: the zone of the session, WGS 84."""

    crs: str = "utm"
    decimals: int = 3
    form: str = ".xyz"
    share: float = 1.0  # of the soundings, by chance
    every: int = 1  # of these every n-th
    outliers: float = 0.0  # share of soundings that are wrong by half a metre
    lift_m: float = 0.0
    seed: tuple[int, int] = (1, 0)


@dataclass(frozen=True)
class Planted:
    """One case: what is planted, the entry, the code that must be named (any of them), and how the file is written."""

    words: str
    entry: Entry
    codes: tuple[str, ...]
    export: Export = Export()


def planted(result: dict[str, Any]) -> Iterator[Planted]:
    """Yield the mistakes, from the content of calibration.json."""
    right, coarse = entry_of(result), result["mbes"]["mount_coarse"]
    (r, p, h), (f, s, d) = right.angles_deg, right.lever_arm_m
    old = entry_of({"mbes": {"mount": coarse}})
    change = np.subtract(right.angles_deg, old.angles_deg), np.subtract(right.lever_arm_m, old.lever_arm_m)

    def case(words: str, *codes: str, **changed: Any) -> Planted:
        return Planted(words, replace(right, **changed), codes)

    yield case("sign of roll", "sign_roll", angles_deg=(-r, p, h))
    yield case("sign of pitch", "sign_pitch", angles_deg=(r, -p, h))
    yield case("sign of heading", "sign_yaw", angles_deg=(r, p, -h))
    yield case("signs of roll and heading", "sign_roll_sign_yaw", angles_deg=(-r, p, -h))
    for order in ("hrp", "phr", "prh", "rhp", "rph"):
        name = {"h": "yaw", "p": "pitch", "r": "roll"}
        yield case(f"order {order}", "order_" + "_".join(name[letter] for letter in order), order=order)
    yield case("x and y exchanged", "axes_yxz", lever_arm_m=(s, f, d))
    yield case("sign of z", "sign_z", lever_arm_m=(f, s, -d))
    yield case("sign of x", "sign_x", lever_arm_m=(f, -s, d))
    yield case("not entered", "not_entered", angles_deg=old.angles_deg, lever_arm_m=old.lever_arm_m)
    yield case("angles not entered", "not_entered", angles_deg=old.angles_deg)
    yield case("lever arm not entered", "not_entered", lever_arm_m=old.lever_arm_m)
    yield case("twice", "twice", angles_deg=_three(right.angles_deg + change[0]),
               lever_arm_m=_three(right.lever_arm_m + change[1]))  # fmt: skip
    yield case("correction alone", "correction_alone", angles_deg=_three(change[0]), lever_arm_m=_three(change[1]))
    yield case("total added to coarse", "added", angles_deg=_three(np.add(right.angles_deg, old.angles_deg)),
               lever_arm_m=_three(np.add(right.lever_arm_m, old.lever_arm_m)))  # fmt: skip
    yield case("angles added to coarse", "added", angles_deg=_three(np.add(right.angles_deg, old.angles_deg)))
    yield case("degrees as radians", "radians", angles_deg=_three(np.degrees(right.angles_deg)))
    yield case("mount twice", "doubled", angles_deg=(2 * r, 2 * p, 2 * h), lever_arm_m=(2 * f, 2 * s, 2 * d))
    yield case("zero", "zero", angles_deg=(0.0, 0.0, 0.0), lever_arm_m=(0.0, 0.0, 0.0))
    yield case("yaw coarse", "coarse_yaw", angles_deg=(r, p, old.angles_deg[2]))
    yield case("lever arm from 0.4, -0.3, 0.2 m", "nothing", lever_arm_m=(f + 0.4, s - 0.3, d + 0.2))
    yield case("lever arm without roll and pitch", "level_lever_arm", level_lever_arm=True)
    yield case("sound speed 0.2 % off", "sound_speed", range_factor=1.002)
    yield Planted("heights 8.312 m lower", right, ("heights",), Export(lift_m=-8.312))


def right_entries(result: dict[str, Any], number: int, seed: int) -> Iterator[Planted]:
    """Yield right entries with settings of three decimals, and exports of all kinds."""
    right = entry_of(result)
    for k in range(number):
        random = np.random.default_rng([seed, k])
        angles = [round(angle, int(random.choice([2, 3, 4]))) for angle in right.angles_deg]
        arm = [round(length, 3) for length in right.lever_arm_m]
        decimals = int(random.choice([2, 3, 3, 4]))
        export = Export(
            crs=str(random.choice(["utm", "EPSG:4978", "EPSG:4979", "EPSG:4549"])),
            decimals=decimals,
            form=str(random.choice(FORMS)),
            share=float(random.choice([1.0, 0.5] if decimals == 2 else [1.0, 1.0, 0.5, 0.2, 0.1])),
            every=1 if decimals == 2 else int(random.choice([1, 1, 2, 5])),
            outliers=float(random.choice([0.0, 0.01, 0.1])),
            seed=(seed, k),
        )
        words = f"right {k}: {export.crs} {export.form} {decimals} decimals, {export.share:g}/{export.every}, "
        words += f"outliers {export.outliers:g}"
        yield Planted(words, replace(right, angles_deg=_three(angles), lever_arm_m=_three(arm)), ("right",), export)


def _three(values: Any) -> tuple[float, float, float]:
    first, second, third = (float(value) for value in values)
    return first, second, third


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
            return case.words, f"refused: {str(error).partition(': ')[2][:90]}", False
    if case.codes == ("right",):
        return case.words, named(check), check.answer.is_right
    if case.codes == ("nothing",):
        return case.words, named(check), not check.answer.explanations and check.answer.rotation_right
    found = {code for one in check.answer.explanations for code in one.keys}
    return case.words, named(check), not check.answer.is_right and bool(found & {*case.codes})


def main() -> None:
    """Print a table: planted, named, right or not."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("session", type=Path)
    parser.add_argument("run", type=Path)
    parser.add_argument("--right", type=int, default=100, help="number of right entries; default: 100")
    parser.add_argument("--only", default="", help="cases whose words begin so")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    run, recorded = FinishedRun.read(options.run, ORDER), recording(options.session)
    result = json.loads((options.run / "report" / "calibration.json").read_text(encoding="utf-8"))
    coarse = run.settings.session.sonar.mount.model_dump()
    result["mbes"]["mount_coarse"] = coarse
    cases = [*planted(result), *right_entries(result, options.right, options.seed)]
    good = 0
    chosen = [case for case in cases if case.words.startswith(options.only)]
    for case in chosen:
        words, answer, is_good = row(run, recorded, case)
        good += is_good
        print(f"{'ok ' if is_good else 'BAD'} {words:40} {answer}", flush=True)
    print(f"{good} of {len(chosen)}")


if __name__ == "__main__":
    main()
