"""NovAtel SPAN: commands that make it output position and attitude of the head.

Rotations are about Z, X, Y, right-handed, in the vehicle frame x starboard, y forward, z up: ours. The fields stand in
the order X, Y, Z: pitch, roll, yaw.
"""

from pipeline.errors import ConfigError
from pipeline.exports.convention import SFU, Convention
from pipeline.exports.explanation import explanation, heading
from pipeline.exports.mounting import Mounting
from pipeline.exports.reading import number, numbers_of, one, whole_lines, written
from pipeline.exports.target import Options, Target
from pipeline.mount import Mounted

DECIMALS = 9
ROTATION = ("pitch", "roll", "yaw")


def _write(target: Target, mounting: Mounting, options: Options) -> str:
    values = target.convention.numbers(mounting.vessel).by_role()
    zeros = "Must be zero afterwards: the mount in every program that uses this output, or it counts twice."
    about = [
        *heading(target, mounting),
        *explanation(target, mounting, options, zeros),
        "Only with RBV = 0 (SETINSROTATION RBV 0 0 0; INSCONFIG shows it): with another, it is not certain from which "
        "frame "
        "USER counts, and these commands must not be used.",
        "The lever arm counts from the IMU's centre, if that is the point whose positions the log holds.",
    ]
    position, rotation = (" ".join(written(values[role], DECIMALS) for role in roles) for roles in ("xyz", ROTATION))
    commands = [f"SETINSTRANSLATION USER {position} 0.0 0.0 0.0 VEHICLE", f"SETINSROTATION USER {rotation}"]
    return "\n".join([*(f"# {line}" for line in about), *commands]) + "\n"


def _read(target: Target, text: str, where: str, _: Options) -> Mounted:
    lines = [tuple(line.upper().split()) for line in whole_lines(text, where) if not line.startswith("#")]
    for words in lines:
        if words[:2] == ("SETINSROTATION", "RBV") and any(number(word, "RBV", where) for word in words[2:5]):
            raise ConfigError(
                f"{where}: RBV is not zero: from which frame USER counts is then not certain; enter it by hand"
            )
    values: dict[str, float] = {}
    for command, roles in (("SETINSTRANSLATION", ("x", "y", "z")), ("SETINSROTATION", ROTATION)):
        words = one([words for words in lines if words[:2] == (command, "USER")], f"commands {command} USER", where)
        if len(words) < 5:
            raise ConfigError(f"{where}: {command} USER has {len(words) - 2} numbers, not 3; correct it")
        values |= {role: number(word, f"{command} {role}", where) for role, word in zip(roles, words[2:5], strict=True)}
        if command == "SETINSTRANSLATION" and len(words) > 8 and words[8] != "VEHICLE":
            raise ConfigError(f"{where}: SETINSTRANSLATION USER is in frame {words[8]}; poolcal reads VEHICLE alone")
    return target.convention.mounted(numbers_of(values))


TARGET = Target(
    name="novatel",
    title="NovAtel SPAN",
    writes="commands, output at the head",
    suffix=".txt",
    convention=Convention(
        SFU,
        (1, 1, 1),
        "YPR",
        "official",
        "docs.novatel.com OEM7, SETINSROTATION, SETINSTRANSLATION; valid with RBV = 0",
    ),
    write=_write,
    read=_read,
    counts_from="ins",
)
