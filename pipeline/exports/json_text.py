"""JSON of other programs, read strictly: a mapping with each key once and finite numbers."""

import json
from typing import Any

from pipeline.errors import ConfigError


def json_of(text: str, where: str) -> dict[str, Any]:
    """Return the mapping that a JSON text holds; raise ConfigError on every fault. ``where``: the file."""

    def refuse(word: str) -> float:
        raise ValueError(f"{word} is no number")

    def pairs(entries: list[tuple[str, Any]]) -> dict[str, Any]:
        content = dict(entries)
        if len(content) < len(entries):
            raise ValueError("a key is there twice")
        return content

    try:
        content = json.loads(text.removeprefix("\ufeff"), parse_constant=refuse, object_pairs_hook=pairs)
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{where}: is no valid JSON ({error}); is the file whole?") from error
    if not isinstance(content, dict):
        raise ConfigError(f"{where}: holds no mapping of keys; name the file that the program wrote")
    return content
