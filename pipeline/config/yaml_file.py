"""Strict reading of a YAML file. Every failure is an error of one line that names the file."""

import hashlib
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from yaml.composer import Composer

from pipeline.atomic_files import read_regular
from pipeline.errors import ConfigError

SESSION_YAML = "session.yaml"  # in every session folder
MAX_YAML_BYTES = 1_000_000
MAX_INTEGER = 2**63


class _StrictLoader(Composer, yaml.CSafeLoader):
    """Load safe YAML; refuse repeated keys (YAML would silently take the last) and aliases (they may expand hugely).

    libyaml scans and parses, five times faster than PyYAML's own scanner; PyYAML composes the events, so that every
    node can be refused.
    """

    def __init__(self, text: str) -> None:
        yaml.CSafeLoader.__init__(self, text)
        Composer.__init__(self)

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.events.AliasEvent):
            raise yaml.YAMLError("aliases (*name) are not accepted")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        keys: set[Any] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if isinstance(key, (list, dict)):
                raise yaml.YAMLError(f"line {key_node.start_mark.line + 1}: a key must be a plain word")
            if key in keys:
                raise yaml.YAMLError(f"line {key_node.start_mark.line + 1}: key {key!r} is given twice")
            keys.add(key)
        return super().construct_mapping(node, deep)

    def construct_yaml_int(self, node: Any) -> int:
        value = super().construct_yaml_int(node)
        if abs(value) >= MAX_INTEGER:  # thousands of digits cannot even be shown
            raise yaml.YAMLError(f"line {node.start_mark.line + 1}: a whole number of more than 18 digits")
        return value


_StrictLoader.add_constructor("tag:yaml.org,2002:int", _StrictLoader.construct_yaml_int)


@dataclass(frozen=True)
class YamlFile:
    """A YAML file as it was at one moment: it is read once, so that text, content and digest are of one state."""

    path: Path
    text: str
    content: dict[str, Any]

    @classmethod
    def read(cls, path: Path) -> "YamlFile":
        """Read a file; raise ConfigError on every failure."""
        text = text_of(path)
        return cls(path, text, content_of(text, path))

    @property
    def sha256(self) -> str:
        """The SHA-256 of the file's bytes. Strict UTF-8 gives the same bytes back."""
        return hashlib.sha256(self.text.encode()).hexdigest()


def read_yaml(path: Path) -> dict[str, Any]:
    """Return the mapping in a YAML file; raise ConfigError on every failure."""
    return YamlFile.read(path).content


def text_of(path: Path) -> str:
    """Return the text of a YAML file unchanged, with its line ends."""
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
    """Return the mapping that a YAML text holds; ``path`` is the file that messages name."""
    content = _loaded(text, path, _StrictLoader.get_single_data)
    if content is None:
        raise ConfigError(f"{path}: is empty; see docs/reference for what it must say")
    if not isinstance(content, dict):
        raise ConfigError(f"{path}: holds {type(content).__name__}, not a mapping of keys; see docs/reference")
    return content


def compose(text: str, path: Path) -> yaml.Node:
    """Return the root node of a YAML text; all nodes know their places in it. ``path`` is the file for messages."""
    node: yaml.Node = _loaded(text, path, _StrictLoader.get_single_node)
    return node


def line_of(root: yaml.Node, location: Sequence[int | str]) -> int:
    """Return the line, counted from 1, of the key or list item at a location; if it is missing, that of its block."""
    node, line = root, root.start_mark.line
    for part in location:
        if isinstance(node, yaml.MappingNode):
            found = [(key, value) for key, value in node.value if key.value == part]
        else:
            items = node.value if isinstance(node, yaml.SequenceNode) else []
            found = [(item, item) for place, item in enumerate(items) if place == part]
        if not found:
            break
        line, node = found[0][0].start_mark.line, found[0][1]
    return line + 1


def _loaded(text: str, path: Path, load: Callable[[_StrictLoader], Any]) -> Any:
    try:
        return load(_StrictLoader(text))
    except (yaml.YAMLError, ValueError) as error:
        words = " ".join(str(error).replace('in "<unicode string>", ', "at ").split())
        raise ConfigError(f"{path}: not valid YAML: {words}; {_remedy(text, error)}") from error
    except RecursionError as error:
        raise ConfigError(f"{path}: not valid YAML: it is nested too deeply; correct the file") from error
    except Exception as error:  # the library may raise any exception for a value that it cannot read
        raise ConfigError(
            f"{path}: not valid YAML: a value is not of the type that its tag or form announces "
            f"({type(error).__name__}: {error}); put it in quotes, and take tags such as !!float out"
        ) from error


def _remedy(text: str, error: Exception) -> str:
    """Return what to do about a text that is no YAML: the commonest slip is no blank behind a colon."""
    mark = getattr(error, "problem_mark", None)
    lines = text.splitlines()
    for number in range(mark.line, max(mark.line - 2, -1), -1) if mark is not None else ():
        slip = re.match(r"[\s{-]*(\w+):[^\s/\\]", lines[number]) if number < len(lines) else None
        if slip:
            return f"write a blank behind the colon of {slip[1]} in line {number + 1}"
    return "correct the file"
