"""``poolcal mount``: a mount from another program's file, on the screen and in session.yaml as the coarse mount."""

from dataclasses import dataclass
from pathlib import Path

from pipeline.atomic_files import read_regular
from pipeline.coarse.session_file import SENSORS, mount_block, mount_origin, read_session, write_mounts
from pipeline.config.mount import Mount
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from pipeline.exports.explanation import REJECTED
from pipeline.exports.mounting import VesselFrame, vector
from pipeline.exports.read_text import change_table
from pipeline.exports.registry import target_named
from pipeline.exports.target import Options
from pipeline.exports.targets.generic import stated_in
from pipeline.exports.writing import mount_in
from pipeline.mount import mount_of
from stages.commands.answer import print_answer

Three = tuple[float, float, float]
MOST_BYTES = 5_000_000


@dataclass(frozen=True)
class ReadOptions:
    """Options of the command; None: not given."""

    sensor: str | None
    ins_point: Three | None
    ins_turn: Three | None
    order: str | None
    serial: str | None
    ins_height: float | None


def command(file: Path, source: str, session: Path, options: ReadOptions, write: bool) -> int:
    """Print the mount beside the present one, and write it into session.yaml.

    Parameters
    ----------
    file
        The program's file.
    source
        The program.
    session
        The folder with session.yaml.
    options
        Sensor, and what the user tells of the program.
    write
        Whether to write the mount into session.yaml.
    """
    target = target_named(source, "--from")
    text, content = read_session(session)
    words = _text_of(file)
    stated, covariance = stated_in(target, words, str(file))
    sensor = options.sensor or stated or target.sensor or "mbes"
    if sensor not in SENSORS or (options.sensor and stated and options.sensor != stated):
        raise ConfigError(f"--sensor {sensor}: must be mbes or laser, and the file's own; leave it out")
    if sensor not in content:
        raise ConfigError(f"{session / 'session.yaml'}: {sensor}: is missing; add its block with files and format")
    told = None
    if options.ins_point is not None or options.ins_turn is not None:
        point, turn = vector(options.ins_point, "--ins-point", 1000.0), vector(options.ins_turn, "--ins-turn", 360.0)
        told = VesselFrame(point, turn)
    found = mount_in(target, words, str(file), told, Options(options.order, options.serial, options.ins_height))
    path = session / "session.yaml"
    present = content[sensor].get("mount")
    old = None if present is None else mount_of(parse(Mount, present, f"{path}: {sensor}.mount"))
    lines = change_table(sensor, found, old)
    if REJECTED in words or '"rejected": true' in words:
        lines.append("The file says that it is of a rejected run: good for a coarse mount at best.")
    if write:
        block = mount_block(found, covariance, mount_origin("coarse", file))
        if covariance is None and "mount_covariance" in content[sensor]:
            block["mount_covariance"] = None  # it belongs to the mount before
        lines.append(write_mounts(session, text, content, {sensor: block}))
    else:
        lines.append(f"{path}: not written (--no-write)")
    if sensor == "laser" and covariance is None:
        lines.append("Set laser.mount_sigma in session.yaml: it is how well this mount is known.")
    return print_answer("\n".join(lines), True)


def _text_of(file: Path) -> str:
    """Return the text of a program's file."""
    try:
        content = read_regular(file, MOST_BYTES)
        if len(content) > MOST_BYTES:
            raise ConfigError(f"{file}: has more than {MOST_BYTES:,} bytes; cut out the part with the mount")
        return content.decode("utf-8").removeprefix("\ufeff")
    except OSError as error:
        raise ConfigError(f"{file}: cannot be read ({error.strerror}); check the path") from error
    except UnicodeDecodeError as error:
        raise ConfigError(
            f"{file}: byte {error.start} is not UTF-8: no text; save the part with the mount as text"
        ) from error
