"""Cases of the campaign of entries: mistakes, right entries, and software that works otherwise than the run."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tools.survey_software import Entry, entry_of

VALUES = ("roll", "pitch", "heading", "forward", "starboard", "down")
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
    """One case.

    Attributes
    ----------
    words, entry
        What is planted.
    codes
        Any of them must be named; none: any may be.
    export
        How the file is written.
    verdicts
        Those that are right.
    """

    words: str
    entry: Entry
    codes: tuple[str, ...]
    export: Export = Export()
    verdicts: tuple[str, ...] = ("wrong", "undecidable")


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
    yield case("lever arm from 0.4, -0.3, 0.2 m", "other_point", lever_arm_m=(f + 0.4, s - 0.3, d + 0.2))


def differences(result: dict[str, Any]) -> Iterator[Planted]:
    """Yield software that works otherwise than the run, with right entries and with wrong ones."""
    right = entry_of(result)
    (r, p, h), (f, s, d) = right.angles_deg, right.lever_arm_m
    but, open_, unsure = ("right_but",), ("right_but", "undecidable"), ("uncertain", "right_but", "undecidable")

    def case(words: str, verdicts: tuple[str, ...], *codes: str, export: Export = Export(), **changed: Any) -> Planted:
        return Planted(words, replace(right, **changed), codes, export, verdicts)

    lower = Export(lift_m=-8.312)
    yield case("heights 8.312 m lower", but, "heights", export=lower)
    yield case("lever arm without roll and pitch", but, "level_lever_arm", level_lever_arm=True)
    yield case("that, heights lower", open_, "heights_level_lever_arm", export=lower, level_lever_arm=True)
    yield case("ranges +0.2 %", but, "sound_speed", range_factor=1.002)
    yield case("ranges +0.2 %, heights lower", but, "heights_sound_speed", export=lower, range_factor=1.002)
    yield case("ranges and steering +0.2 %", unsure, range_factor=1.002, steer_factor=1.002)
    yield case("steering +0.3 %", unsure, steer_factor=1.003)
    yield case("sound speed grows by 0.5 m/s a metre", ("uncertain", "right_but"), gradient_per_s=0.5)
    yield case("sound speed falls by 3 m/s a metre", ("uncertain", "right_but"), gradient_per_s=-3.0)
    yield case("datum 0.35, -0.2, 0.1 m", but, "shift", shift_m=(0.35, -0.2, 0.1))
    yield case("datum 0.35, -0.2, 0.1 m, 2 decimals", unsure, "shift", export=Export(decimals=2),
               shift_m=(0.35, -0.2, 0.1))  # fmt: skip
    yield case("positions 0.02, 0.02, 0 m", open_, "shift", shift_m=(0.02, 0.02, 0.0))
    yield case("grid 1000, 0 m off", ("refused",), shift_m=(1000.0, 0.0, 0.0))
    for delay_s in (0.02, -0.3, 1.0, 18.0, -18.0):
        yield case(f"poses {delay_s:+g} s late", open_, "delay", delay_s=delay_s)
    yield case("attitudes: heading +0.2", open_, "attitudes", attitude_deg=(0.0, 0.0, 0.2))
    yield case("attitudes: heading +2", unsure, "attitudes", attitude_deg=(0.0, 0.0, 2.0))
    yield case("attitudes: roll -0.05, pitch 0.03", open_, "attitudes", attitude_deg=(-0.05, 0.03, 0.0))
    for size_m in (0.003, 0.02, 0.1):
        yield case(f"another trajectory, {size_m:g} m", ("right",) * (size_m < 0.01) + unsure, wander_m=size_m)
    yield case("mean of 5 beams", ("uncertain", "right", "refused"), smoothed_beams=5)
    yield case("sign of roll, trajectory 0.02 m", ("wrong", "undecidable"), "sign_roll",
               angles_deg=(-r, p, h), wander_m=0.02)  # fmt: skip
    yield case("sign of heading, datum", ("wrong", "undecidable"), "sign_yaw",
               angles_deg=(r, p, -h), shift_m=(0.35, -0.2, 0.1))  # fmt: skip
    yield case("sign of x, ranges +0.2 %", ("wrong", "undecidable"), "sign_x",
               lever_arm_m=(f, -s, d), range_factor=1.002)  # fmt: skip
    yield case("sign of z, heights lower", ("wrong", "undecidable"), "sign_z", export=lower, lever_arm_m=(f, s, -d))
    wrong = ("wrong", "undecidable", "uncertain")
    slips: dict[str, dict[str, Any]] = {
        "roll 0.03 off": {"angles_deg": (r + 0.03, p, h)},
        "x 0.012 m off": {"lever_arm_m": (f, s + 0.012, d)},
    }
    works: dict[str, dict[str, Any]] = {
        "": {}, ", trajectory 0.02 m": {"wander_m": 0.02}, ", sound speed falls": {"gradient_per_s": -3.0},
        ", ranges +0.2 %": {"range_factor": 1.002},
    }  # fmt: skip
    for name, changed in slips.items():
        for more, otherwise in works.items():
            yield case(name + more, wrong, **changed, **otherwise)
    yield case("a fiftieth, by chance", ("right", "uncertain", "refused"), export=Export(share=0.02))


def right_entries(result: dict[str, Any], number: int, seed: int) -> Iterator[Planted]:
    """Yield right entries with settings of two to four decimals, and exports of all kinds."""
    right = entry_of(result)
    for k in range(number):
        random = np.random.default_rng([seed, k])
        angles = [round(angle, int(random.choice([2, 3, 4]))) for angle in right.angles_deg]
        arm = [round(length, 3) for length in right.lever_arm_m]
        words, export = _any_export(random, (seed, k))
        entry = replace(right, angles_deg=_three(angles), lever_arm_m=_three(arm))
        yield Planted(f"right {k}: {words}", entry, (), export, ("right",))


def near_entries(result: dict[str, Any], number: int, seed: int) -> Iterator[Planted]:
    """Yield entries that are wrong by one and a half to three tolerances in one value: none may be called right."""
    right = entry_of(result)
    for k in range(number):
        random = np.random.default_rng([seed, k])
        words, export = _any_export(random, (seed, k))
        off = np.zeros(6)
        off[k % 6] = random.choice([-1, 1]) * random.uniform(1.5, 3.0) * (0.01 if k % 6 < 3 else 0.005)
        entry = replace(
            right,
            angles_deg=_three(right.angles_deg + off[:3]),
            lever_arm_m=_three(right.lever_arm_m + off[3:]),
            gradient_per_s=float(random.choice([0.0, 0.0, 0.3])),
            wander_m=float(random.choice([0.0, 0.0, 0.003])),
        )
        wrong = f"near {k}: {VALUES[k % 6]} {off[k % 6]:+.4f}, "
        yield Planted(wrong + words, entry, (), export, ("wrong", "undecidable", "uncertain"))


def _any_export(random: np.random.Generator, seed: tuple[int, int]) -> tuple[str, Export]:
    decimals = int(random.choice([2, 3, 3, 4]))
    export = Export(
        crs=str(random.choice(["utm", "EPSG:4978", "EPSG:4979", "EPSG:4549"])),
        decimals=decimals,
        form=str(random.choice(FORMS)),
        share=float(random.choice([1.0, 0.5] if decimals == 2 else [1.0, 1.0, 0.5, 0.2, 0.1])),
        every=1 if decimals == 2 else int(random.choice([1, 1, 2, 5])),
        outliers=float(random.choice([0.0, 0.01, 0.1])),
        seed=seed,
    )
    words = f"{export.crs} {export.form} {decimals} decimals, {export.share:g}/{export.every}, "
    return f"{words}outliers {export.outliers:g}", export


def _three(values: Any) -> tuple[float, float, float]:
    first, second, third = (float(value) for value in values)
    return first, second, third
