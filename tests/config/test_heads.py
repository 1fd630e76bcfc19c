"""``mbes`` as a list: the heads' names, what must be alike, what is refused, and run.yaml read again."""

import json
from pathlib import Path
from typing import Any

import pytest
import yaml

from pipeline.config.load import load_session, session_in
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_file import YamlFile
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError

MOUNT = {"roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0, "x_m": 0.0, "y_m": 0.0, "z_m": 0.0}
HEAD = {"files": ["a.xtf"], "format": "r2sonic", "mount": MOUNT}
OTHER = HEAD | {"files": ["b.xtf"], "latency_s": 0.5}


def content(mbes: Any, **more: Any) -> dict[str, Any]:
    block = {"files": ["x"], "format": "las", "mount": MOUNT}
    whole = {"name": "s", "ins": {"files": ["x"], "format": "novatel"}, "laser": block, "mbes": mbes, **more}
    copied: dict[str, Any] = json.loads(json.dumps(whole))  # YAML would write what stands in it twice as an alias
    return copied


def session(mbes: Any) -> SessionConfig:
    return parse(SessionConfig, content(mbes), "session.yaml")


def test_a_list_of_one_is_a_block() -> None:
    assert session([HEAD]) == session(HEAD)
    assert list(session([HEAD]).heads) == ["mbes"]
    assert "mbes_2" not in session([HEAD]).model_dump()


def test_the_first_keeps_its_name_and_the_others_are_counted() -> None:
    three = session([HEAD, OTHER, HEAD])
    assert list(three.heads) == ["mbes", "mbes_2", "mbes_3"]
    assert three.mbes == session(HEAD).mbes
    alone = three.alone("mbes_2")
    assert alone.mbes is not None
    assert (alone.mbes.files, alone.mbes.latency_s) == (["b.xtf"], 0.5)
    assert list(alone.heads) == ["mbes"]
    assert parse(SessionConfig, three.model_dump(mode="json"), "run.yaml") == three


@pytest.mark.parametrize(
    ("mbes", "words"),
    [
        ([], "mbes: lists 0 heads; give 1 to 4"),
        ([HEAD] * 5, "mbes: lists 5 heads; give 1 to 4"),
        ([HEAD, OTHER | {"latency": 1.0}], "mbes_2.latency: unknown key; is it latency_s or latency_sigma_s?"),
        ([HEAD, {"files": ["b"]}], "mbes_2.format: is missing"),
        ([HEAD, OTHER | {"sound_speed_m_s": 1500.0}], "mbes_2.sound_speed_m_s is not that of the first head"),
        ([HEAD, OTHER | {"svp": [[0.0, 1500.0], [3.0, 1501.0]]}], "mbes_2.svp is not that of the first head"),
    ],
)
def test_faults_name_the_head(mbes: Any, words: str) -> None:
    with pytest.raises(ConfigError) as refused:
        session(mbes)
    assert words in str(refused.value)


def test_several_heads_are_taken_only_where_they_are_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "session.yaml"
    path.write_text(yaml.safe_dump(content([HEAD, OTHER])), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"mbes: lists 2 heads, and this command takes a session of one"):
        load_session(tmp_path)
    assert len(session_in(YamlFile.read(path), several_heads=True).heads) == 2


def test_a_block_beside_the_list_is_refused(tmp_path: Path) -> None:
    (tmp_path / "session.yaml").write_text(yaml.safe_dump(content(HEAD, mbes_2=OTHER)), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"mbes_2: unknown key; write all heads under mbes, as a list"):
        load_session(tmp_path)


def test_each_head_has_its_own_preset(tmp_path: Path) -> None:
    heads = [HEAD | {"instrument": "r2sonic_2024"}, OTHER]
    (tmp_path / "session.yaml").write_text(yaml.safe_dump(content(heads)), encoding="utf-8")
    read = session_in(YamlFile.read(tmp_path / "session.yaml"), several_heads=True).heads
    assert read["mbes"].instrument is not None
    assert read["mbes_2"].instrument is None
