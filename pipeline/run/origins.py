"""Where the value of a setting comes from: the crew's file, the preset that it names, or the program's default."""

from functools import reduce
from typing import Any

from pydantic import BaseModel

from pipeline.config.references import InstrumentUsed
from pipeline.run.settings import Settings

SESSION, POOL, DEFAULT = "session", "pool", "default"
UNRECORDED = "default, or the same in the file"  # an older run.yaml does not say which


def origin_of(settings: Settings, key: str, changed: bool = False) -> str:
    """Return where a setting's value comes from.

    Parameters
    ----------
    settings
        The run's settings.
    key
        The dotted key in session.yaml (``laser.range_sigma_m``), or that in the pool's config
        (``as_built.face_sigma_m``).
    changed
        Whether the value is known not to be the default; the key may then go on into free names, as those of faces.

    Returns
    -------
    str
        ``session`` or ``pool`` if that file has the key, whatever its value; ``preset (name)`` if the instrument's
        preset gave it; otherwise ``default``. In a run that does not record the keys a value that is not the default
        is the file's.
    """
    model = _model_of(settings, key)
    file, words = ("session", SESSION) if model is settings.session else ("config", POOL)
    preset = preset_of(settings, key)
    of_figure = None if preset is None else preset.origins.get(key.partition(".")[2])
    if preset is not None and of_figure == "preset":
        return f"preset ({preset.name})"
    if file in settings.stated:
        return words if key in settings.stated[file] else DEFAULT
    if of_figure is not None:
        return words if of_figure == "session" else DEFAULT
    return words if changed or value_of(settings, key) != default_at(type(model), key) else UNRECORDED


def is_assumed(settings: Settings, key: str) -> bool:
    """Return whether nobody stated a setting: neither a file nor a preset gave its value."""
    return origin_of(settings, key) == DEFAULT


def is_recorded(settings: Settings) -> bool:
    """Return whether the run tells a default from the same value in a file; an older run does not."""
    return {"session", "config"} <= {*settings.stated}


def preset_of(settings: Settings, key: str) -> InstrumentUsed | None:
    """Return the preset of the sensor to which a setting belongs; None if it has none."""
    block = getattr(settings.session, key.partition(".")[0], None)
    return getattr(block, "instrument", None)


def value_of(settings: Settings, key: str) -> Any:
    """Return the value of a setting, by its dotted key as of :func:`origin_of`."""
    return reduce(getattr, key.split("."), _model_of(settings, key))


def _model_of(settings: Settings, key: str) -> BaseModel:
    """Return the settings, the session's or the pool's, to which a key belongs."""
    of_session = key.partition(".")[0] in type(settings.session).model_fields
    return settings.session if of_session else settings.pool


def default_at(model: type[BaseModel], key: str) -> Any:
    """Return the default of a setting; None for one that has none, or that lies in a block without a default."""
    name, _, rest = key.partition(".")
    field = model.model_fields[name]
    inner = next(iter(_models(field.annotation)), None)
    if rest:
        return None if inner is None else default_at(inner, rest)
    return None if field.is_required() else field.get_default(call_default_factory=True)


def _models(annotation: Any) -> list[type[BaseModel]]:
    """Return the models in an annotation such as ``Mbes | None``."""
    parts = getattr(annotation, "__args__", (annotation,))
    return [part for part in parts if isinstance(part, type) and issubclass(part, BaseModel)]
