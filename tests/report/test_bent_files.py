"""YAML and meshes that no editor writes, files that are none, patterns without end: one line each, at once."""

import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.atomic_files import read_json, read_regular
from pipeline.config.mount import Mount
from pipeline.config.session import Ins, Laser, SessionConfig
from pipeline.config.target_mesh import with_mesh
from pipeline.config.yaml_file import MAX_YAML_BYTES, read_yaml
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError, RawDataError
from pipeline.readers.dispatch import raw_files, raw_parts
from tests.support.limits import limited
from tests.support.toy_run import MOUNT

ELSE = "ins: {files: [a], format: table}\nlaser: {files: [a], format: table, mount: MOUNT}\n".replace("MOUNT", MOUNT)


@pytest.fixture(autouse=True)
def limits() -> Iterator[None]:
    with limited():
        yield


@pytest.mark.parametrize(
    "value",
    [
        "!!bool x", "!!int ''", "!!int '-'", "!!int x", "!!float ''", "!!float x", "!!timestamp x", "!!set [a]",
        "!!set {a: 1}", "{? !!set {a} : 1}", "!!omap [a]", "!!binary é", "!!python/name:os.system", "0x" + "f" * 5000,
        "0" + "7" * 6000, "0b" + "1" * 20_000, "9" * 5000, ":".join(["59"] * 3000), ":".join(["59"] * 3000) + ".5",
        "{" + "9" * 5000 + ": 1}", "-" + "9" * 19, "[" * 5000,
    ],
    ids=lambda value: value[:20],
)  # fmt: skip
def test_a_value_that_cannot_be_read_is_one_line(value: str, tmp_path: Path) -> None:
    path = tmp_path / "session.yaml"
    path.write_text(ELSE + f"name: {value}\n", encoding="utf-8")
    with pytest.raises(ConfigError) as told:
        parse(SessionConfig, read_yaml(path), str(path))
    assert str(path) in str(told.value)
    assert len(str(told.value)) < 2000


def test_numbers_that_fit_are_read(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(f"a: {2**63 - 1}\nb: -{2**63 - 1}\nc: 0x1f\nd: 1:30\ne: !!float 3\n")
    assert read_yaml(path) == {"a": 2**63 - 1, "b": 1 - 2**63, "c": 31, "d": 90, "e": 3.0}


# --- files that are none ---------------------------------------------------------------------------------------------
def test_a_fifo_is_not_waited_for_nor_a_device_read_without_end(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "session.yaml")
    (tmp_path / "pool.yaml").symlink_to("/dev/zero")
    for name in ("session.yaml", "pool.yaml"):
        with pytest.raises(ConfigError, match=f"{name}: cannot be read .is no regular file"):
            read_yaml(tmp_path / name)
        with pytest.raises(OSError, match="is no regular file"):
            read_json(tmp_path / name)
    (tmp_path / "folder.yaml").mkdir()
    with pytest.raises(ConfigError, match="cannot be read"):
        read_yaml(tmp_path / "folder.yaml")


def test_no_more_is_read_than_allowed(tmp_path: Path) -> None:
    path = tmp_path / "large.yaml"
    path.write_bytes(b"#" * (MAX_YAML_BYTES - 5) + b"\na: 1")
    assert read_yaml(path) == {"a": 1}
    with path.open("ab") as file:
        file.write(b"1")
    with pytest.raises(ConfigError, match=r"\d{7} bytes is no config"):
        read_yaml(path)
    with path.open("r+b") as file:
        file.truncate(2**40)  # a hole of a terabyte
    assert len(read_regular(path, 100)) == 101
    with pytest.raises(ConfigError, match=r"\d{7} bytes is no config"):
        read_yaml(path)


@pytest.mark.parametrize("name", ["target.obj", "target.ply"])
def test_a_mesh_that_is_no_file(tmp_path: Path, name: str) -> None:
    content = {"target": {"kind": "faces", "mesh": name}}
    (tmp_path / name).symlink_to("/dev/zero")
    with pytest.raises(ConfigError, match="leads out of this file's folder"):
        with_mesh(content, tmp_path / "pool.yaml")
    (tmp_path / name).unlink()
    os.mkfifo(tmp_path / name)
    with pytest.raises(ConfigError, match="is no regular file"):
        with_mesh(content, tmp_path / "pool.yaml")


# --- patterns --------------------------------------------------------------------------------------------------------
def test_a_pattern_may_search_folders_twice_and_no_more(tmp_path: Path) -> None:
    """Each further ** takes several times as long: twenty nested folders are enough for hours."""
    deep = tmp_path.joinpath(*["d"] * 24)
    deep.mkdir(parents=True)
    (deep / "a.gps").write_bytes(b"1")
    settings = Ins.model_validate({"files": ["**/**/*.gps"], "format": "table"})
    begin = time.monotonic()
    assert raw_files(settings, tmp_path) == [deep / "a.gps"]
    assert time.monotonic() - begin < 5
    for pattern in ("**/**/**/*.gps", "a" * 301):
        with pytest.raises(ValueError, match=r"\*\* twice at most"):
            Ins.model_validate({"files": [pattern], "format": "table"})


@pytest.mark.parametrize("pattern", ["ins/*.gps", "*/*.gps", "**/*.gps", "ins/a.gps"])
def test_a_folder_that_may_not_be_read_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pattern: str
) -> None:
    """Not that it holds no file: and where files lie elsewhere as well, its own would be left out in silence."""
    for folder in ("ins", "more"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a.gps").write_bytes(b"1")
    settings = Ins.model_validate({"files": [pattern], "format": "table"})
    assert raw_files(settings, tmp_path)
    scandir = os.scandir

    def refuse(path: str | Path = ".") -> object:
        if Path(path).name == "ins":
            raise PermissionError(13, "Permission denied", str(path))
        return scandir(path)

    monkeypatch.setattr(os, "scandir", refuse)
    with pytest.raises(RawDataError, match=r"cannot be searched .*Permission denied.*ins"):
        raw_files(settings, tmp_path)


def test_a_refused_cell_does_not_fill_the_screen(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t_ns,x_m,y_m,z_m\n1,2,3,4\n1,2,3," + "n" * 5000 + "\n" + "1,2\n")
    settings = Laser.model_validate(
        {"files": ["a.csv"], "format": "table", "mount": dict.fromkeys(Mount.model_fields, 0.0)}
    )
    with pytest.raises(RawDataError) as told:
        [chunk for part in raw_parts("laser", settings, tmp_path) for chunk in part.chunks()]
    assert 50 < len(str(told.value)) < 500
