"""What settings that cannot be meant are answered with: the value, and what is likely meant."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from pipeline.config.load import load_pool, load_session
from pipeline.config.target import Letters
from pipeline.errors import ConfigError
from pipeline.report.ambiguities import MountSearch, ambiguities
from tests.support.places import poolcal

MOUNT = {"roll_deg": -48.0, "pitch_deg": 2.0, "yaw_deg": -2.8, "x_m": 0.38, "y_m": 0.12, "z_m": -2.09}
ORIGIN = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}
TARGET = {"a": 8.0, "b": 3.0, "c": 1.0, "e": 0.5, "origin": ORIGIN}


def _session() -> dict[str, Any]:
    return {
        "ins": {"files": ["ins/*"], "format": "sbet", "gps_week": 2418},
        "laser": {"files": ["laser/*"], "format": "las", "mount": dict(MOUNT)},
        "mbes": {"files": ["mbes/*"], "format": "r2sonic", "mount": dict(MOUNT)},
    }


def _refusal(folder: Path, content: dict[str, Any]) -> str:
    (folder / "session.yaml").write_text(yaml.safe_dump(content, default_flow_style=False))
    with pytest.raises(ConfigError) as refused:
        load_session(folder)
    return str(refused.value)


def test_a_key_without_its_unit_is_named_and_not_the_one_missing(tmp_path: Path) -> None:
    content = _session()
    content["mbes"]["mount"] = {key if key != "roll_deg" else "roll": value for key, value in MOUNT.items()}
    said = _refusal(tmp_path, content)
    assert "mbes.mount.roll: unknown key; is it roll_deg? known here: pitch_deg, roll_deg" in said


def test_a_key_that_is_missing_alone_is_told_to_be(tmp_path: Path) -> None:
    content = _session()
    del content["mbes"]["mount"]["roll_deg"]
    assert "mbes.mount.roll_deg: is missing; add it" in _refusal(tmp_path, content)
    del content["mbes"]["mount"]
    assert "mbes.mount: is missing; add it with its six keys, roll_deg, pitch_deg, yaw_deg, x_m, y_m, z_m, or let" in (
        _refusal(tmp_path, content)
    )


def test_a_second_head_has_a_session_of_its_own(tmp_path: Path) -> None:
    content = _session()
    content["mbes2"] = _session()["mbes"]
    said = _refusal(tmp_path, content)
    assert "mbes2: unknown key; write all heads under mbes, as a list of blocks" in said


@pytest.mark.parametrize(("week", "said"), [(370, "370 + 2048 = 2418"), (999, "999 + 1024 = 2023")])
def test_a_week_modulo_1024(tmp_path: Path, week: int, said: str) -> None:
    content = _session()
    content["ins"]["gps_week"] = week
    assert said in _refusal(tmp_path, content)
    content["ins"]["gps_week"] = 5001
    assert "2048" not in _refusal(tmp_path, content)
    content["ins"]["gps_week"] = 1000
    (tmp_path / "session.yaml").write_text(yaml.safe_dump(content))
    assert load_session(tmp_path).ins.gps_week == 1000


def test_millimetres_in_a_mount(tmp_path: Path) -> None:
    content = _session()
    content["mbes"]["mount"]["x_m"] = 380
    assert "mbes.mount.x_m = 380" in (said := _refusal(tmp_path, content))
    assert "in metres: is 380 in mm? It is then 0.38" in said
    content["mbes"]["mount"] |= {"x_m": 0.38, "roll_deg": 4000.0}
    assert "mm" not in _refusal(tmp_path, content)  # of an angle nobody has millimetres


def _pool_refusal(folder: Path, **target: Any) -> str:
    (folder / "pool.yaml").write_text(yaml.safe_dump({"target": TARGET | target}))
    with pytest.raises(ConfigError) as refused:
        load_pool(folder / "pool.yaml")
    return str(refused.value)


def test_millimetres_in_a_target(tmp_path: Path) -> None:
    assert "target.a = 8000" in (said := _pool_refusal(tmp_path, a=8000))
    assert "is 8000 in mm? It is then 8" in said
    assert "mm" not in _pool_refusal(tmp_path, a=-1)


def test_latitude_and_longitude_interchanged(tmp_path: Path) -> None:
    said = _pool_refusal(tmp_path, origin=ORIGIN | {"latitude_deg": 120.1, "longitude_deg": 36.0})
    assert "Write latitude_deg: 36 and longitude_deg: 120.1" in said
    said = _pool_refusal(tmp_path, origin=ORIGIN | {"latitude_deg": 95.0})  # as a longitude it would not do either
    assert "latitude_deg = 95" in said
    assert "longitude_deg" not in said


def test_a_session_in_the_pools_place(tmp_path: Path) -> None:
    (tmp_path / "session.yaml").write_text(yaml.safe_dump(_session()))
    with pytest.raises(ConfigError, match="is a session's file; --config wants the pool's"):
        load_pool(tmp_path / "session.yaml")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("run", "s"), "missing: --config FILE: the pool's YAML file, which says where the target is; poolcal init"),
        (("run", "s", "--config", "p"), "missing: --run RUN: the folder for the results"),
        (("plan", "p"), "missing: --session SESSION: the folder with session.yaml"),
        (("nonsense",), "No such command 'nonsense'; see poolcal --help"),
    ],
)
def test_an_option_left_out_is_described(words: tuple[str, ...], said: str) -> None:
    told = poolcal(*words)
    assert told.status == 2
    assert said in told.err
    assert f"see poolcal {words[0] + ' ' if words[0] != 'nonsense' else ''}--help" in told.err
    assert ".;" not in told.err


def test_exchanged_sides_are_looked_for_first_where_they_fit() -> None:
    import pandas as pd

    pose = {"ambiguous": True, "within": True, "rival": "left and right exchanged", "agreement_m2": 36.7}
    mount = pd.Series({"within": True, "ambiguous": False, "rival_score": 0.0, "score": 1.0})
    target = Letters.model_validate(TARGET, strict=False)
    search = MountSearch(sensor="mbes", max_angle_deg=4.5, max_lever_arm_m=0.45)

    def said(rival: str, agreement: float) -> str:
        rival_pose = pd.Series(pose | {"rival": rival, "rival_agreement_m2": agreement})
        (reason,) = ambiguities(rival_pose, mount, search, target.shape, target.sides)
        return reason.words

    assert "check target.low_side first, then target.origin" in said("left and right exchanged", 43.2)
    assert "first" not in said("one period higher", 43.2)
    assert "first" not in said("left and right exchanged, half a period higher", 36.0)
    assert "poolcal check tells which" in said("one period higher", 43.2)
