"""configs/: the file of defaults says what the models say, key by key; the scenarios load."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from pipeline.config.load import load_pool
from pipeline.config.pool import PoolConfig
from pipeline.config.session import Mbes
from pipeline.config.target import Letters
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from pipeline.simulation.scenario import Scenario
from tests.support.roots import CONFIGS

DEFAULTS = CONFIGS / "defaults.yaml"


def _leaves(model: type[BaseModel], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Each key's path and its field, blocks resolved into their keys."""
    for name, field in model.model_fields.items():
        inner = Letters if name == "target" else field.annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from _leaves(inner, (*path, name))
        else:
            yield (*path, name), field


LEAVES = list(_leaves(PoolConfig))


def _at(content: Any, path: tuple[str, ...]) -> Any:
    for name in path:
        content = content[name]
    return content


def _names(content: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    if not isinstance(content, dict) or not content:
        yield path
        return
    for name, value in content.items():
        yield from _names(value, (*path, name))


def test_defaults_load() -> None:
    assert isinstance(load_pool(DEFAULTS), PoolConfig)


def test_defaults_name_every_key_and_no_other() -> None:
    assert sorted(_names(read_yaml(DEFAULTS))) == sorted(path for path, _ in LEAVES)


def test_keys_come_in_the_models_order() -> None:
    assert list(_names(read_yaml(DEFAULTS))) == [path for path, _ in LEAVES]


@pytest.mark.parametrize(("path", "field"), LEAVES, ids=[".".join(path) for path, _ in LEAVES])
def test_defaults_are_the_models(path: tuple[str, ...], field: Any) -> None:
    value = _at(read_yaml(DEFAULTS), path)
    if not field.is_required():
        default = field.get_default(call_default_factory=True)
        assert value == (list(default) if isinstance(default, tuple) else default)
        assert type(value) is (list if isinstance(default, tuple) else type(default))


def test_required_keys_are_those_of_the_contract() -> None:
    required = {".".join(path) for path, field in LEAVES if field.is_required()}
    letters = {f"target.{letter}" for letter in "abce"}
    assert required == letters | {f"target.origin.{key}" for key in ("latitude_deg", "longitude_deg", "height_m")}


def test_nothing_but_the_required_keys_is_needed() -> None:
    content = read_yaml(DEFAULTS)
    target = {name: content["target"][name] for name in ("a", "b", "c", "e", "origin")}
    assert parse(PoolConfig, {"target": target}, "short") == load_pool(DEFAULTS)


@pytest.mark.parametrize("path", sorted((CONFIGS / "scenarios").glob("*.yaml")), ids=lambda path: path.stem)
def test_scenarios_load(path: Path) -> None:
    assert parse(Scenario, read_yaml(path), path.name).name == path.stem


SONAR: dict[str, Any] = {
    "files": ["a.bth"],
    "format": "r2sonic",
    "mount": {"roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0, "x_m": 0.0, "y_m": 0.0, "z_m": -1.0},
}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"svp": [[0.0, 1500.0]]}, "svp = [[0.0, 1500.0]]: has too few entries: 1 of at least 2; correct"),
        ({"svp": [[0, 5, 1500], [3, 1501]]}, "svp.0 = [0, 5, 1500]: has more entries than 2; a decimal comma"),
        ({"svp": [[1500.0, 0.0], [1501.0, 3.0]]}, "svp.0.0 = 1500.0: input should be less than or equal to 200"),
        ({"svp": [[0.0, 4855.0], [9.0, 4857.0]]}, "1700 (m/s; is it in feet a second? It is then 1479.8); each row of"),
        ({"svp": [[0.0, 900.0], [9.0, 901.0]]}, "to 1300; each row of svp is [depth in m, speed in m/s]; correct"),
        ({"sound_speed_m_s": 1.48}, "to 1300 (m/s; is it in km/s? It is then 1480.0); correct"),
        ({"svp": [[2.0, 1500.0], [2.0, 1501.0]]}, "depths must grow"),
        ({"sound_speed_m_s": "1500,5"}, "'1500,5': input should be a valid number, with a point where the comma is"),
        ({"sound_speed_m_s": "{1}"}, "'{1}': input should be a valid number; correct"),
        ({"files": "a.bth"}, "input should be a list, in square brackets"),
    ],
)
def test_one_line_says_what_to_correct(change: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError) as refused:
        parse(Mbes, SONAR | change, "session.yaml")
    (line,) = str(refused.value).splitlines()
    assert line.startswith("session.yaml: ")
    assert words in line
