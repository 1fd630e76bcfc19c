"""YAML files into models: strictly, and every fault in one line that names file and key."""

import json
import math
from collections.abc import Callable, Iterator
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar, get_args

import yaml
from pydantic import BaseModel, Tag, ValidationError

from pipeline.atomic_files import read_regular
from pipeline.errors import ConfigError

M = TypeVar("M", bound=BaseModel)
MAX_YAML_BYTES = 1_000_000
MAX_INTEGER = 2**63


class _StrictLoader(yaml.SafeLoader):
    """Safe YAML that refuses a key given twice (YAML would silently take the last) and aliases (no bombs)."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.events.AliasEvent):
            raise yaml.YAMLError("aliases (*name) are not accepted")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        seen: set[Any] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if isinstance(key, (list, dict)):
                raise yaml.YAMLError(f"line {key_node.start_mark.line + 1}: a key must be a plain word")
            if key in seen:
                raise yaml.YAMLError(f"line {key_node.start_mark.line + 1}: key {key!r} is given twice")
            seen.add(key)
        return super().construct_mapping(node, deep)

    def construct_yaml_int(self, node: Any) -> int:
        value = super().construct_yaml_int(node)
        if abs(value) >= MAX_INTEGER:  # thousands of digits cannot even be shown
            raise yaml.YAMLError(f"line {node.start_mark.line + 1}: a whole number of more than 18 digits")
        return value


_StrictLoader.add_constructor("tag:yaml.org,2002:int", _StrictLoader.construct_yaml_int)


def read_yaml(path: Path) -> dict[str, Any]:
    """One mapping from a YAML file; every way this can fail is a ConfigError."""
    return content_of(text_of(path), path)


def text_of(path: Path) -> str:
    """A YAML file's text as it stands, line ends and all."""
    try:
        content = read_regular(path, MAX_YAML_BYTES)
        if len(content) > MAX_YAML_BYTES:
            raise ConfigError(f"{path}: {path.stat().st_size} bytes is no config; name the YAML file meant")
        return content.decode("utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}); check the path") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: byte {error.start} is not UTF-8; save the file as UTF-8 text") from error


def content_of(text: str, path: Path) -> dict[str, Any]:
    """The mapping that it says."""
    content = _loaded(text, path, _StrictLoader.get_single_data)
    if content is None:
        raise ConfigError(f"{path}: is empty; see README.md for what it must say")
    if not isinstance(content, dict):
        raise ConfigError(f"{path}: holds {type(content).__name__}, not a mapping of keys; see README.md")
    return content


def compose(text: str, path: Path) -> yaml.Node:
    """The text's nodes, which know their places in it."""
    node: yaml.Node = _loaded(text, path, _StrictLoader.get_single_node)
    return node


def _loaded(text: str, path: Path, how: Callable[[_StrictLoader], Any]) -> Any:
    try:
        return how(_StrictLoader(text))
    except (yaml.YAMLError, ValueError) as error:
        raise ConfigError(f"{path}: not valid YAML: {error}; correct the file") from error
    except RecursionError as error:
        raise ConfigError(f"{path}: not valid YAML: it is nested too deeply; correct the file") from error
    except Exception as error:  # the library alone runs here, and raises anything at a value it cannot read
        raise ConfigError(
            f"{path}: not valid YAML: a value is not what it is said or seems to be ({type(error).__name__}: {error}); "
            "put it in quotes, and take tags such as !!float out"
        ) from error


LETTERS = tuple(f"target.{letter}" for letter in "abce")
FOOT_M = 0.3048
Location = tuple[int | str, ...]
_WORDS = {  # where pydantic speaks to programmers
    "too_short": "has too few entries: {actual_length} of at least {min_length}",
    "too_long": "has more entries than {max_length}; a decimal comma makes two of one",
    "union_tag_invalid": "has kind {tag}, which is none of {expected_tags}",
}


def parse(model: type[M], content: dict[str, Any], where: str) -> M:
    """Check ``content`` against ``model``; the first fault becomes one line that names the key."""
    try:
        return model.model_validate_json(_to_json(content, where), strict=True)
    except ValidationError as error:
        fault = _first(error.errors(include_url=False))
        place = _without_tags(model, fault["loc"])
        key = ".".join(str(part) for part in place if part not in ("function-after", "[key]")) or "(whole file)"
        if fault["type"] == "extra_forbidden":
            known = ", ".join(_known_keys(model, fault["loc"][:-1]))
            meant = _meant(str(fault["loc"][-1]), known.split(", "))
            raise ConfigError(f"{where}: {key}: unknown key; {meant}known here: {known}") from error
        if fault["type"] == "missing":
            raise ConfigError(f"{where}: {key}: is missing; {_missing(model, fault['loc'])}") from error
        message = _WORDS[fault["type"]].format(**fault["ctx"]) if fault["type"] in _WORDS else fault["msg"]
        message = message.removeprefix("Value error, ").replace("a valid array", "a list, in square brackets")
        if fault["type"] == "float_type" and "," in str(fault["input"]):
            message += ", with a point where the comma is"
        message += _in_metres(key, fault) + _in_m_s(key, fault)
        shown = repr(fault["input"])
        shown = shown if len(shown) <= 60 else shown[:57] + "..."
        raise ConfigError(f"{where}: {key} = {shown}: {message[0].lower()}{message[1:]}; correct this value") from error


def _first(faults: list[Any]) -> Any:
    """The fault to be told: an unknown key before one that is missing beside it, for it may be that one misspelt."""
    first = faults[0]
    beside = (one for one in faults if one["type"] == "extra_forbidden" and one["loc"][:-1] == first["loc"][:-1])
    return next(beside, first) if first["type"] == "missing" else first


def _meant(unknown: str, known: list[str]) -> str:
    """What an unknown key may be.

    >>> _meant("roll", ["roll_deg", "x_m"]), _meant("mbes2", ["ins", "mbes"])
    ('is it roll_deg? ', 'one mbes is calibrated at a time: write one session.yaml for each; ')
    """
    bare = unknown.rstrip("0123456789_")
    if bare != unknown and bare in known:
        return f"one {bare} is calibrated at a time: write one session.yaml for each; "
    begun = [key for key in known if key.startswith(f"{unknown}_") or unknown.startswith(f"{key}_")]
    alike = begun or get_close_matches(unknown, known, 1, 0.75)
    return f"is it {' or '.join(alike)}? " if alike else ""


def _missing(model: type[BaseModel], location: Location) -> str:
    if location[-1] == "mount":
        keys = ", ".join(_fields(model, location))
        return f"add it with its six keys, {keys}, or let poolcal coarse write it"
    return "add it"


def _in_metres(key: str, fault: Any) -> str:
    """A word where a length is out of bounds in metres, and would not be if it were given in millimetres."""
    value, bounds = fault["input"], fault.get("ctx", {})
    last = key.rpartition(".")[2]
    length = last.endswith("_m") or ".corners." in key or key in LETTERS
    beyond = fault["type"] in ("less_than_equal", "greater_than_equal") and isinstance(value, (int, float))
    if not (length and beyond) or abs(value) / 1000 > abs(bounds.get("le", bounds.get("ge", 0.0))):
        return ""
    return f", in metres: is {value:g} in mm? It is then {value / 1000:.4g}"


def _in_m_s(key: str, fault: Any) -> str:
    """A word where a sound speed is out of bounds in m/s, and would not be in another unit; how a cast's row is read.

    >>> _in_m_s("mbes.svp.0.1", {"type": "less_than_equal", "input": 4855.0})
    ' (m/s; is it in feet a second? It is then 1479.8); each row of svp is [depth in m, speed in m/s]'
    """
    value, row = fault["input"], "svp" in key.split(".")
    beyond = fault["type"] in ("less_than_equal", "greater_than_equal") and isinstance(value, (int, float))
    if not beyond or not (row or key.endswith("sound_speed_m_s")):
        return ""
    units = ((FOOT_M, "feet a second"), (1000.0, "km/s"))
    told = (f" (m/s; is it in {unit}? It is then {value * m:.1f})" for m, unit in units if 1300 <= value * m <= 1700)
    return next(told, "") + ("; each row of svp is [depth in m, speed in m/s]" if row else "")


def _to_json(content: dict[str, Any], where: str) -> str:
    """JSON between YAML and model: strict JSON mode reads lists as tuples and whole numbers as floats, nothing else."""

    def check(value: Any, key: str) -> None:
        if isinstance(value, dict):
            for name, item in value.items():
                if not isinstance(name, str):
                    raise ConfigError(f"{where}: {key}{name!r}: a key must be a word; write it as text")
                check(item, f"{key}{name}.")
        elif isinstance(value, list):
            for position, item in enumerate(value):
                check(item, f"{key}{position}.")
        elif isinstance(value, float) and not math.isfinite(value):
            raise ConfigError(f"{where}: {key[:-1]} = {value}: is not a finite number; correct this value")
        elif not isinstance(value, (str, int, float, bool, type(None))):
            raise ConfigError(f"{where}: {key[:-1]} = {value}: is a {type(value).__name__}; put it in quotes")

    check(content, "")
    return json.dumps(content)


def _known_keys(model: type[BaseModel], location: Location) -> list[str]:
    return sorted(_fields(model, location)) or ["see README.md"]


def _fields(model: type[BaseModel], location: Location) -> list[str]:
    """Keys that the model at this place in a file has, in its order; none where there is none."""
    current: Any = model
    for part in location:
        field = getattr(current, "model_fields", {}).get(part)
        current = field.annotation if field is not None else _tagged(current).get(part)
        models = (one for one in get_args(current) if isinstance(one, type) and issubclass(one, BaseModel))
        current = next(models, current)  # a block that may be left out altogether
    return list(getattr(current, "model_fields", ()))


def _tagged(annotation: Any) -> dict[int | str, Any]:
    """The models of a union by their tags."""
    found: dict[int | str, Any] = {}
    for one in get_args(annotation):
        tags = [mark.tag for mark in getattr(one, "__metadata__", ()) if isinstance(mark, Tag)]
        found |= dict.fromkeys(tags, get_args(one)[0] if tags else None)
    return found


def _without_tags(model: type[BaseModel], location: Location) -> Location:
    """A fault's place as the file has it: no tag of a union stands there."""
    current: Any = model
    kept = []
    for part in location:
        tagged = _tagged(current)
        if part in tagged:
            current = tagged[part]
            continue
        kept.append(part)
        field = getattr(current, "model_fields", {}).get(part)
        current = field.annotation if field is not None else None
    return tuple(kept)


def changes(model: BaseModel, prefix: str = "") -> Iterator[tuple[str, Any, Any]]:
    """What was set to something else than its default: key, default (None: it has none), value."""
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        default = None if field.is_required() else field.get_default(call_default_factory=True)
        if isinstance(value, BaseModel):
            yield from changes(value, f"{prefix}{name}.")
        elif isinstance(value, dict) and value and all(isinstance(one, BaseModel) for one in value.values()):
            for key, one in value.items():
                yield from changes(one, f"{prefix}{name}.{key}.")
        elif isinstance(value, tuple) and any(isinstance(one, BaseModel) for one in value):
            yield f"{prefix}{name}", default, [one.model_dump(mode="json", exclude_none=True) for one in value]
        elif field.is_required() or value != default:
            yield f"{prefix}{name}", default, value
