"""A session.yaml to write mounts into, and surveys to find them by."""

from pathlib import Path

import pytest

from tests.support.marks import PLAIN


@pytest.fixture
def session(tmp_path: Path) -> Path:
    folder = tmp_path / "session"
    folder.mkdir()
    (folder / "session.yaml").write_text(PLAIN, encoding="utf-8")
    return folder




