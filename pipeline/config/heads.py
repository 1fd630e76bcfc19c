"""Several heads of one sonar: ``mbes`` as a list of blocks. The first is called mbes, the next mbes_2, and so on."""

import re
from collections.abc import Mapping
from typing import Any

from pydantic import SerializerFunctionWrapHandler, model_serializer

from pipeline.config.quantities import Model
from pipeline.errors import ConfigError

HEADS = ("mbes", "mbes_2", "mbes_3", "mbes_4")
FURTHER = re.compile("mbes_[2-4]")


class WithHeads(Model):
    """A model with a field for each of HEADS. Only the first is a key of the file: as a block, or a list of blocks.

    Written out, a head that is not there has no key.
    """

    @classmethod
    def prepared(cls, content: Mapping[str, Any], where: str) -> dict[str, Any]:
        """Return a file's content with each head in a block of its own; ``where``: the file."""
        return heads_apart(content, where)

    @model_serializer(mode="wrap")
    def _without_absent_heads(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        written: dict[str, Any] = handler(self)
        return {key: value for key, value in written.items() if value is not None or not FURTHER.fullmatch(key)}


def heads_apart(content: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return a file's content with each head in a block of its own, in place of the list ``mbes``.

    Parameters
    ----------
    content : mapping
        Content of session.yaml or of a scenario. A block that is no list is left as it is.
    where : str
        The file, for messages.

    Raises
    ------
    ConfigError
        The list is empty or too long.

    >>> heads_apart({"mbes": [{"files": ["a"]}, {"files": ["b"]}]}, "session.yaml")
    {'mbes': {'files': ['a']}, 'mbes_2': {'files': ['b']}}
    """
    heads = content.get("mbes")
    if not isinstance(heads, list):
        return dict(content)
    if not 1 <= len(heads) <= len(HEADS):
        raise ConfigError(f"{where}: mbes: lists {len(heads)} heads; give 1 to {len(HEADS)}, or take mbes out")
    return dict(content) | dict(zip(HEADS, heads, strict=False))


def refuse_single_blocks(content: Mapping[str, Any], where: str) -> None:
    """Raise a ConfigError if a file has a block of a further head beside ``mbes``; ``where``: the file."""
    for key in content:
        if FURTHER.fullmatch(str(key)):
            raise ConfigError(f"{where}: {key}: unknown key; write all heads under mbes, as a list of blocks")


def refuse_several(content: Mapping[str, Any], where: str) -> None:
    """Raise a ConfigError if content of :func:`heads_apart` has several heads; ``where``: the file."""
    count = sum(head in content for head in HEADS)
    if count > 1:
        raise ConfigError(
            f"{where}: mbes: lists {count} heads, and this command takes a session of one; list only the head that you "
            "mean"
        )
