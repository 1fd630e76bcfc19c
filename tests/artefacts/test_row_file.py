"""Rows in a temporary file: what is read is what was written, and a full disk is one line."""

import os
import resource
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from pipeline.artefacts.row_file import RowFile
from pipeline.errors import ArtefactError

COLUMNS = 7


@pytest.fixture
def small_disk() -> Iterator[int]:
    """Let no file become longer than these bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
    yield 4096
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("rows", [[], [0], [2999], [5, 4, 5], [0, 2999], list(range(1200, 2400))])
def test_rows_are_read_as_they_were_written(rows: list[int]) -> None:
    written = np.random.default_rng(1).normal(size=(3000, COLUMNS))  # 168 kB: some pages
    file = RowFile(COLUMNS)
    for part in (written[:1], written[1:1], written[1:2000], written[2000:]):
        file.append(part)
    found = file.read(np.array(rows, dtype=np.int64))
    np.testing.assert_array_equal(found, written[rows].reshape(-1, COLUMNS))
    found[:] = 0.0  # a copy
    np.testing.assert_array_equal(file.read(np.arange(3000)), written)


def test_columns_that_are_not_contiguous_are_written_row_by_row() -> None:
    written = np.arange(60.0).reshape(COLUMNS - 1, 10).T
    file = RowFile(COLUMNS - 1)
    file.append(written)
    np.testing.assert_array_equal(file.read(np.arange(10)), written)


def test_the_file_has_no_name_and_is_closed_when_nothing_refers_to_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    before = set(os.listdir("/proc/self/fd"))
    file = RowFile(COLUMNS)
    file.append(np.ones((3, COLUMNS)))
    assert not list(tmp_path.iterdir())
    assert set(os.listdir("/proc/self/fd")) - before
    del file
    assert not set(os.listdir("/proc/self/fd")) - before


@pytest.mark.parametrize("rows", [100, 4096])
def test_a_full_disk_is_one_line_that_names_the_folder(
    small_disk: int, rows: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing more is said when the file is closed."""
    assert rows * COLUMNS * 8 > small_disk
    file = RowFile(COLUMNS)
    with pytest.raises(ArtefactError, match=r"a temporary file cannot be written \(File too large\); .*TMPDIR="):
        file.append(np.ones((rows, COLUMNS)))
    del file
    assert capsys.readouterr().err == ""


def test_a_folder_that_is_not_there_is_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "absent"))
    with pytest.raises(ArtefactError, match=r"absent: a temporary file cannot be written \(No such file"):
        RowFile(COLUMNS)
