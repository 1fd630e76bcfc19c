"""session.yaml edited as text: the mounts and what goes with them, and not one byte else.

Places come from the YAML's own nodes: each number of a ``mount`` is replaced where it stands, so that comments, order,
line ends and styles stay; a key that is missing is put in after its neighbour. What comes of it is read again and must
be the session that was meant, or nothing is written.
"""

import itertools
import json
import os
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

import pipeline
from pipeline.atomic_files import sha256, write_bytes, writing
from pipeline.config.instruments import merge_presets
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_file import compose, content_of, text_of
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from pipeline.maths.mount_parameters import SETTINGS
from pipeline.mount import Mounted
from pipeline.readers.casts import with_cast

SENSORS = ("laser", "mbes")
NOWHERE = dict.fromkeys(SETTINGS, 0.0)
Array = NDArray[np.float64]
Content = dict[str, Any]
Edit = tuple[int, int, str]  # the text from here to there becomes this


def read_session(folder: Path) -> tuple[str, Content]:
    """Text and content of session.yaml, which may still lack mounts: all else in it is checked."""
    if not folder.is_dir():
        raise ConfigError(f"{folder}: is no folder; SESSION is the folder that holds session.yaml")
    path = folder / "session.yaml"
    text = text_of(path)
    content = content_of(text, path)
    _check(content, folder)
    return text, content


def _check(content: Content, folder: Path) -> SessionConfig:
    path = folder / "session.yaml"
    filled = with_cast(merge_presets(content, folder)[0], folder)
    for name in SENSORS:
        if isinstance(filled.get(name), dict):
            filled[name] = {"mount": NOWHERE} | filled[name]
    return parse(SessionConfig, {"name": "session"} | filled, str(path))


def origin_of(method: str, file: Path, **more: Any) -> Content:
    """Where a mount comes from, as it stands beside it."""
    name = "".join(letter if letter.isprintable() else "?" for letter in file.name)[:300]
    today = datetime.now(UTC).date().isoformat()
    software = f"poolcal {pipeline.__version__}"
    return {"method": method, "file": name, "sha256": sha256(file), "date": today, "software": software} | more


def block_of(mounted: Mounted, covariance: Array, origin: Content) -> Content:
    """What a sensor's block is to say: numbers rounded as they will be written; ``covariance`` (6, 6)."""
    six = {key: round(value, 6) + 0.0 for key, value in mounted.settings().items()}
    return {
        "mount": six,
        "mount_origin": origin | {"mount": six},
        "mount_covariance": [[float(f"{one:.9e}") for one in row] for row in covariance.tolist()],
    }


def written(folder: Path, text: str, content: Content, blocks: Mapping[str, Content]) -> str:
    """The blocks into session.yaml, unless it says so already (the day and the version alone are no change); what was
    done, in words."""
    path = folder / "session.yaml"
    if all(_same(content[name], block) for name, block in blocks.items()):
        return f"{path}: has these mounts already; not written"
    new = edited(text, blocks, path)
    refuse_other(new, content, blocks, path)
    kept = replace_session(folder, text, new)
    return f"{path}: {' and '.join(f'{name}.mount' for name in blocks)} written; what was there is in {kept.name}"


def _same(there: Content, block: Content) -> bool:
    one, other = (side.get("mount_origin") or {} for side in (there, block))
    origins = one.get("sha256") == other["sha256"] and one.get("method") == other["method"]
    return origins and all(there.get(key) == block[key] for key in ("mount", "mount_covariance"))


def edited(text: str, blocks: Mapping[str, Content], path: Path) -> str:
    """The text with keys ``mount``, ``mount_origin`` and ``mount_covariance`` of each sensor as in its block.

    Raises
    ------
    ConfigError
        The text is written so that this cannot be done in place.
    """
    edits = [edit for name, block in blocks.items() for edit in _edits(text, name, block, path)]
    for start, end, new in sorted(edits, reverse=True):
        text = text[:start] + new + text[end:]
    return text


def refuse_other(text: str, content: Content, blocks: Mapping[str, Content], path: Path) -> None:
    """The edited text must say what the content said, but for the blocks; and be a session."""
    meant = content | {name: content[name] | block for name, block in blocks.items()}
    try:
        found = content_of(text, path)
    except ConfigError:
        found = {}
    if found != meant:
        raise ConfigError(
            f"{path}: mount cannot be edited where it stands; write laser and mbes as plain blocks, one key a line"
        )
    _check(found, path.parent)


def _edits(text: str, sensor: str, block: Content, path: Path) -> Iterable[Edit]:
    node = _value(compose(text, path), sensor)
    mount = _value(node, "mount") if node is not None else None
    anchor = mount if mount is not None else _value(node, "format")
    if node is None or anchor is None:
        raise ConfigError(f"{path}: {sensor}: has no format; add it")
    break_ = "\r\n" if "\r\n" in text else "\n"
    indent = " " * node.value[0][0].start_mark.column
    between = ", " if node.flow_style else f",{break_}{indent}  "
    missing = []
    for key, value in block.items():
        there = _value(node, key)
        if key == "mount" and isinstance(there, yaml.MappingNode):
            for name, number in value.items():
                scalar = _value(there, name)
                if scalar is not None:
                    yield scalar.start_mark.index, scalar.end_mark.index, f"{number:.6f}"
        elif there is not None:  # from the key on: what stood in lines of its own may not be indented enough
            name = next(name for name, _ in node.value if name.value == key)
            yield name.end_mark.index, _end(there), f": {in_yaml(key, value, between)}"
        else:
            missing.append(f"{key}: {in_yaml(key, value, between)}")
    if not missing:
        return
    place = len(text[: _end(anchor)].rstrip())
    if node.flow_style:
        yield place, place, "".join(f", {words}" for words in missing)
        return
    line = len(text) if (found := text.find("\n", place)) < 0 else found + 1
    words = "".join(f"{indent}{one}{break_}" for one in missing)
    yield line, line, words if text[:line].endswith("\n") else break_ + words


def _value(node: Any, key: str) -> Any:
    """The value's node of a mapping's key; None where there is none."""
    pairs = node.value if isinstance(node, yaml.MappingNode) else ()
    return next((value for name, value in pairs if name.value == key), None)


def _end(node: Any) -> int:
    """Where a node's text ends: of a block, where its last part does (YAML counts the blank lines and comments on)."""
    if isinstance(node, yaml.ScalarNode) or node.flow_style or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _end(last[1] if isinstance(last, tuple) else last)


def in_yaml(key: str, value: Any, between: str) -> str:
    """Numbers with a point, for YAML takes 1e-06 for a word; ``between``: what stands between a matrix's rows."""
    if key == "mount":
        return "{" + ", ".join(f"{name}: {number:.6f}" for name, number in value.items()) + "}"
    if key == "mount_origin":
        words = {name: in_yaml(name, one, between) if name == "mount" else json.dumps(one, ensure_ascii=False)
                 for name, one in value.items()}
        return "{" + ", ".join(f"{name}: {one}" for name, one in words.items()) + "}"
    return "[" + between.join("[" + ", ".join(f"{one:.9e}" for one in row) + "]" for row in value) + "]"


def replace_session(folder: Path, old: str, text: str) -> Path:
    """``old``, what was there, is kept as session.1.yaml, session.2.yaml … (the first free), whose path is given back.

    Whole or not at all: the new one is written beside and renamed over.
    """
    path = folder / "session.yaml"
    kept = _keep(folder, old.encode("utf-8"))
    try:
        write_bytes(path, text.encode("utf-8"))
    except BaseException:
        kept.unlink(missing_ok=True)
        raise
    return kept


def _keep(folder: Path, content: bytes) -> Path:
    for number in itertools.count(1):
        path = folder / f"session.{number}.yaml"
        with writing(path):
            try:
                file = path.open("xb")
            except FileExistsError:
                continue
            try:
                with file:
                    file.write(content)
                    file.flush()
                    os.fsync(file.fileno())
            except BaseException:
                path.unlink(missing_ok=True)
                raise
            return path
    raise AssertionError
