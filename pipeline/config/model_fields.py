"""The keys that a model knows at a place in a file."""

from typing import Any, get_args

from pydantic import BaseModel, Tag

from pipeline.config.heads import FURTHER

Location = tuple[int | str, ...]  # place of a value in a file, as pydantic reports it: keys, and numbers in lists


def known_keys(model: type[BaseModel], location: Location) -> list[str]:
    """Return the keys known at this place, sorted, for a message."""
    names = (name for name in field_names(model, location) if not FURTHER.fullmatch(name))
    return sorted(names) or ["see docs/reference"]


def field_names(model: type[BaseModel], location: Location) -> list[str]:
    """Return the keys of the model at this place, in the model's order; an empty list if there is no model."""
    current: Any = model
    for part in location:
        if isinstance(part, int) and isinstance(current, type):  # an item of a list of such models
            continue
        field = getattr(current, "model_fields", {}).get(part)
        current = field.annotation if field is not None else _tagged(current).get(part)
        members = get_args(current)
        models = (model for model in members if isinstance(model, type) and issubclass(model, BaseModel))
        current = next(models, current)  # the model of an optional block
    return list(getattr(current, "model_fields", ()))


def _tagged(annotation: Any) -> dict[int | str, Any]:
    """Return the models of a union by their tags."""
    models: dict[int | str, Any] = {}
    for member in get_args(annotation):
        tags = [mark.tag for mark in getattr(member, "__metadata__", ()) if isinstance(mark, Tag)]
        models |= dict.fromkeys(tags, get_args(member)[0] if tags else None)
    return models


def without_tags(model: type[BaseModel], location: Location) -> Location:
    """Return a fault's place as in the file: without the tags of unions, which pydantic adds."""
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
