"""The settings of a run: both YAML files are read once, so that a file saved meanwhile gives no mixture."""

import hashlib
from collections import Counter
from pathlib import Path

import pytest

from pipeline.atomic_files import read_regular
from pipeline.config import yaml_file
from pipeline.config.instruments import PRESETS
from pipeline.run.settings import load_settings
from tests.support.preset_sessions import session

POOL = (PRESETS.parent / "defaults.yaml").read_text(encoding="utf-8")


def test_a_file_saved_while_it_is_read_gives_no_mixture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Values, the keys that count as stated, and the digest are those of one state of the file."""
    (tmp_path / "s").mkdir()
    session(tmp_path / "s", laser={"range_sigma_m": 0.006})
    pool = tmp_path / "pool.yaml"
    pool.write_text(POOL, encoding="utf-8")
    paths = {"session": tmp_path / "s" / "session.yaml", "config": pool}
    before = {name: path.read_bytes() for name, path in paths.items()}
    reads: Counter[Path] = Counter()

    def read_then_saved(path: Path, most: int) -> bytes:
        reads[path] += 1
        content = read_regular(path, most)
        path.write_text(content.decode().replace("range_sigma_m: 0.006", "angle_sigma_deg: 0.01") + "# saved\n")
        return content

    monkeypatch.setattr(yaml_file, "read_regular", read_then_saved)
    settings = load_settings(tmp_path / "s", pool)
    assert reads == dict.fromkeys(paths.values(), 1)
    assert settings.session.laser.range_sigma_m == 0.006
    assert "laser.range_sigma_m" in settings.stated["session"]
    assert settings.files == {name: hashlib.sha256(content).hexdigest() for name, content in before.items()}


@pytest.mark.parametrize("text", ["\ufeff# marked\n", "# 流\r\nname: 水池\r\n"])
def test_the_digest_is_that_of_the_bytes(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(f"{text}a: 1\n".encode())
    assert yaml_file.YamlFile.read(path).sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
