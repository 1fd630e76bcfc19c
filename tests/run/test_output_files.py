"""What the disk holds before a rename says that it is complete."""

import os
from pathlib import Path

import pytest

from tests.support.toy_run import Pool


# --- what the disk holds before a rename says that it is complete ----------------------------------------------------
def test_every_file_is_on_the_disk_before_the_folder_takes_its_place(
    pool: Pool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A power cut after the rename must not leave a manifest beside empty tables."""
    done: list[str] = []
    sync, rename = os.fsync, Path.rename

    def synced(handle: int) -> None:
        done.append(os.readlink(f"/proc/self/fd/{handle}"))
        sync(handle)

    def renamed(self: Path, target: Path) -> Path:
        if self.suffix == ".partial":
            inside = {str(path) for path in (self, *self.rglob("*"))}
            assert len(inside) >= 3
            assert inside <= set(done)
            done.append(f"{self} renamed")
        return rename(self, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(Path, "rename", renamed)
    pool.run()
    for stage in ("take", "sift", "tell"):
        assert str(pool.run_folder) in done[done.index(f"{pool.run_folder / stage}.partial renamed") :]
