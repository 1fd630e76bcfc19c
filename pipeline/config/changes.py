"""Settings that differ from their defaults."""

from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel


def changed_settings(model: BaseModel, prefix: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield key, default (None if it has none) and value of each setting that differs from its default.

    ``prefix`` comes before the keys: the key of the block and a dot.
    """
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        default = None if field.is_required() else field.get_default(call_default_factory=True)
        if isinstance(value, BaseModel):
            yield from changed_settings(value, f"{prefix}{name}.")
        elif isinstance(value, dict) and value and all(isinstance(block, BaseModel) for block in value.values()):
            for key, block in value.items():
                yield from changed_settings(block, f"{prefix}{name}.{key}.")
        elif isinstance(value, tuple) and any(isinstance(entry, BaseModel) for entry in value):
            yield f"{prefix}{name}", default, [entry.model_dump(mode="json", exclude_none=True) for entry in value]
        elif field.is_required() or value != default:
            yield f"{prefix}{name}", default, value
