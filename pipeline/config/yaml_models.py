"""Strict conversion of YAML content into models. Every fault is an error of one line that names file and key."""

import json
import math
from typing import Any, TypeVar

import yaml
from pydantic import ValidationError

from pipeline.config.faults import fault_line
from pipeline.config.quantities import Model
from pipeline.errors import ConfigError

M = TypeVar("M", bound=Model)


def parse(model: type[M], content: dict[str, Any], where: str, root: yaml.Node | None = None) -> M:
    """Check the content of a file against a model.

    Parameters
    ----------
    model : type[M]
        The strict model.
    content : dict[str, Any]
        The mapping that the file holds.
    where : str
        The file, and the block within it, for messages.
    root : yaml.Node, optional
        The same content with its places in the file, so that the message has the line as well.

    Returns
    -------
    M
        The settings.

    Raises
    ------
    ConfigError
        The content has a fault. The message is one line, about the first fault that matters.
    """
    prepared = model.prepared(content, where)
    try:
        return model.model_validate_json(_to_json(prepared, where), strict=True)
    except ValidationError as error:
        raise ConfigError(fault_line(model, error.errors(include_url=False), where, root)) from error


def _to_json(content: dict[str, Any], where: str) -> str:
    """Return the content as JSON, from which strict models accept lists for tuples, and whole numbers for floats."""

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
