"""Reading session.yaml, and writing mounts into it, for ``poolcal coarse``, ``poolcal laser``, ``poolcal mount``."""

import itertools
import os
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pipeline
from pipeline.atomic_files import sha256, write_bytes, writing
from pipeline.coarse.session_edit import edit_mounts
from pipeline.config.fill_in import is_unfilled, refuse_unfilled
from pipeline.config.heads import heads_apart, refuse_several
from pipeline.config.instruments import merge_presets
from pipeline.config.load import session_yaml
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_file import YamlFile, content_of
from pipeline.config.yaml_models import parse
from pipeline.maths.mount_parameters import SETTINGS
from pipeline.mount import Mounted
from pipeline.readers.casts import with_cast

SENSORS = ("laser", "mbes")
MOUNTS = tuple(f"{name}.mount" for name in SENSORS)
ZERO_MOUNT = dict.fromkeys(SETTINGS, 0.0)
Array = NDArray[np.float64]
Content = dict[str, Any]


def read_session(folder: Path) -> tuple[str, Content]:
    """Return text and content of session.yaml. Everything in it is checked; only mounts may be missing.

    A mount that is still to be filled in counts as missing, and is not in the content.
    """
    file = YamlFile.read(session_yaml(folder))
    refuse_several(heads_apart(file.content, str(file.path)), str(file.path))
    content = _without_unfilled_mounts(file.content)
    refuse_unfilled([file], may_be=lambda one: one.block in MOUNTS or one.key in MOUNTS)
    _check(content, folder)
    return file.text, content


def _without_unfilled_mounts(content: Content) -> Content:
    blocks = {name: content[name] for name in SENSORS if isinstance(content.get(name), dict)}
    return content | {
        name: {key: value for key, value in block.items() if key != "mount" or not is_unfilled(value)}
        for name, block in blocks.items()
    }


def _check(content: Content, folder: Path) -> SessionConfig:
    path = folder / "session.yaml"
    filled = with_cast(merge_presets(content, folder)[0], folder)
    for name in SENSORS:
        if isinstance(filled.get(name), dict):
            filled[name] = {"mount": ZERO_MOUNT} | filled[name]
    return parse(SessionConfig, {"name": "session"} | filled, str(path))


def mount_origin(method: str, file: Path, **more: Any) -> Content:
    """Return the block ``mount_origin`` of session.yaml, which names the source of a mount.

    Parameters
    ----------
    method
        ``coarse`` or ``fine``.
    file
        The file that the mount was computed from.
    more
        Further keys of the block.
    """
    name = "".join(letter if letter.isprintable() else "?" for letter in file.name)[:300]
    today = datetime.now(UTC).date().isoformat()
    software = f"poolcal {pipeline.__version__}"
    return {"method": method, "file": name, "sha256": sha256(file), "date": today, "software": software} | more


def mount_block(mounted: Mounted, covariance: Array | None, origin: Content) -> Content:
    """Return the keys of a sensor's block that hold a mount, with numbers rounded as they will be written.

    Parameters
    ----------
    mounted
        The mount.
    covariance
        Its covariance, (6, 6): rotation x, y, z and lever arm x, y, z in body axes; rad and m. None: not known.
    origin
        Source of the mount, from :func:`mount_origin`.
    """
    mount = {key: round(value, 6) + 0.0 for key, value in mounted.settings().items()}
    block: Content = {"mount": mount, "mount_origin": origin | {"mount": mount}}
    return block if covariance is None else block | {"mount_covariance": written_covariance(covariance)}


def written_covariance(covariance: Array) -> list[list[float]]:
    """Return a covariance with numbers rounded as they will be written."""
    return [[float(f"{value:.9e}") for value in row] for row in covariance.tolist()]


def write_mounts(folder: Path, text: str, content: Content, blocks: Mapping[str, Content]) -> str:
    """Write mounts into session.yaml and return a sentence for the user about it.

    Nothing is written if session.yaml has these mounts already; their date and software version may differ.

    Parameters
    ----------
    folder
        The session's folder.
    text, content
        Text and content of session.yaml, from :func:`read_session`.
    blocks
        By sensor, the keys to write, from :func:`mount_block`.
    """
    path = folder / "session.yaml"
    if all(_is_same(content.get(name, {}), block) for name, block in blocks.items()):
        return f"{path}: has these mounts already; not written"
    new = edit_mounts(text, blocks, path)
    _check(_without_unfilled_mounts(content_of(new, path)), folder)
    kept = _replace_session(folder, text, new)
    return f"{path}: {' and '.join(f'{name}.mount' for name in blocks)} written; what was there is in {kept.name}"


def _is_same(present: Content, block: Content) -> bool:
    old, new = (side.get("mount_origin") or {} for side in (present, block))
    same_source = old.get("sha256") == new["sha256"] and old.get("method") == new["method"]
    return same_source and all(present.get(key) == value for key, value in block.items() if key != "mount_origin")


def _replace_session(folder: Path, old: str, new: str) -> Path:
    """Keep the old text as session.1.yaml, session.2.yaml … (the first name that is free) and return that file's path.

    The new text is written whole or not at all, because it is written beside session.yaml and then renamed over it.
    """
    kept = _keep(folder, old.encode("utf-8"))
    try:
        write_bytes(folder / "session.yaml", new.encode("utf-8"))
    except BaseException:  # whatever stops it, Ctrl-C included
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
            except BaseException:  # whatever stops it, Ctrl-C included
                path.unlink(missing_ok=True)
                raise
            return path
    raise AssertionError
