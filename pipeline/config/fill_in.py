"""Values that a person must still fill in. ``poolcal init`` marks them, and no command takes the mark for a value."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import yaml

from pipeline.config.yaml_file import YamlFile, compose
from pipeline.errors import ConfigError

MARK = "FILL_IN"
WHAT: Mapping[str, str] = {  # by key, or by the block that holds it: what to fill in, with its sign and unit
    "files": "the sensor's files: paths or patterns inside the session folder",
    "format": "the format of these files",
    "gps_week": "the GPS week in which the first file begins; 2026-05-12: 2418",
    "frame": "laser, where the points are in the scanner's own frame; else their CRS, such as EPSG:4978",
    "heights": "ellipsoidal, if the points' heights are above the ellipsoid; else export them so",
    "sound_speed_m_s": "the true sound speed at the head, m/s",
    "laser.mount": "the laser's angles and lever arm, finely calibrated: poolcal coarse, then poolcal laser",
    "mbes.mount": "the sonar's angles and lever arm, to 3 degrees and 0.3 m: poolcal coarse",
    "roll_deg": "degrees; starboard side down is +",
    "pitch_deg": "degrees; bow up is +",
    "yaw_deg": "degrees; counter-clockwise seen from above is +",
    "x_m": "m, from the INS's point to the sensor; to starboard is +",
    "y_m": "m; forward is +",
    "z_m": "m; up is +",
    "target.a": "height of the centre wall, m",
    "target.b": "width of the centre wall, m",
    "target.c": "legs of a block's right-angled triangle, m",
    "target.e": "a block's height, and the gap to the next above, m",
    "target.low_side": "south or north: the side, -y or +y, whose lowest block stands at the wall's foot",
    "target.water_level_m": "height of the water less that of the wall's centre, m: both above the ellipsoid",
    "target.origin": "the centre of the wall's front face, in the datum of the INS's positions",
    "latitude_deg": "degrees; north is +",
    "longitude_deg": "degrees; east is +",
    "height_m": "m above the ellipsoid, not above the sea",
}


@dataclass(frozen=True)
class Unfilled:
    """A key whose value is still to be filled in.

    Attributes
    ----------
    key : str
        The key with the keys of the blocks round it, parted by points.
    line : int
        Its line in the file, from 1.
    """

    key: str
    line: int

    @property
    def block(self) -> str:
        """The key of the block that holds it; empty at the top of the file."""
        return self.key.rpartition(".")[0]


def what(key: str) -> str:
    """Return the words for what is to be filled in; an empty text for an unknown key.

    >>> what("laser.mount.z_m"), what("target.a")
    ('m; up is +', 'height of the centre wall, m')
    """
    return WHAT.get(key, WHAT.get(key.rpartition(".")[2], ""))


def unfilled(text: str, path: Path) -> list[Unfilled]:
    """Return the keys still to be filled in, in order of their lines; ``path`` is the file that messages name."""
    return list(_marked(compose(text, path), "")) if MARK in text else []


def _marked(node: Any, key: str) -> Iterator[Unfilled]:
    if isinstance(node, yaml.ScalarNode) and node.value == MARK:
        yield Unfilled(key, node.start_mark.line + 1)
    elif isinstance(node, yaml.MappingNode):
        for name, value in node.value:
            yield from _marked(value, f"{key}.{name.value}" if key else str(name.value))
    elif isinstance(node, yaml.SequenceNode):
        for value in node.value:
            yield from _marked(value, key)


def is_unfilled(value: Any) -> bool:
    """Return whether a value, or one of the values in a block, is still to be filled in."""
    return MARK in (value.values() if isinstance(value, dict) else [value] if isinstance(value, str) else [])


def refuse_unfilled(files: Iterable[YamlFile], may_be: Callable[[Unfilled], bool] = lambda _: False) -> None:
    """Raise a ConfigError, one line, that names all keys still to be filled in, with their lines and their meaning.

    Parameters
    ----------
    files
        The YAML files.
    may_be
        Whether a key may be left as it is, because the command fills it in.
    """
    missing = {file.path: [one for one in unfilled(file.text, file.path) if not may_be(one)] for file in files}
    named = {path: listed(keys) for path, keys in missing.items() if keys}
    if named:
        head = f"still to be filled in, in place of {MARK}"
        raise ConfigError("; and ".join(f"{path}: {head}: {words}" for path, words in named.items()))


def listed(missing: list[Unfilled]) -> str:
    """Return the text that lists keys, those of one block together."""
    return "; ".join(words for block, keys in groupby(missing, lambda one: one.block) for words in _of(block, [*keys]))


def _of(block: str, keys: list[Unfilled]) -> Iterator[str]:
    """Yield the words of one block's keys: all of them in one if the table has words for the block, else one by one."""
    if block in WHAT and len(keys) > 1:
        names = ", ".join([keys[0].key, *(one.key.rpartition(".")[2] for one in keys[1:])])
        yield f"lines {keys[0].line} to {keys[-1].line} {names} ({WHAT[block]})"
        return
    for one in keys:
        words = what(one.key)
        yield f"line {one.line} {one.key}" + (f" ({words})" if words else "")
