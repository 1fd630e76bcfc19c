"""What the readers of all forms share: numbers in text, and faults in one line."""

import math
from collections.abc import Mapping

import numpy as np

from pipeline.errors import ConfigError
from pipeline.exports.convention import Convention, Numbers

ROLES = ("x", "y", "z", "roll", "pitch", "yaw")


def number(text: object, what: str, where: str) -> float:
    """Return a number written as text or as a number; raise ConfigError if it is none, or not finite.

    Parameters
    ----------
    text
        The value.
    what, where
        Its name and its file, for the message.
    """
    try:
        if isinstance(text, bool) or not isinstance(text, (str, int, float)):
            raise ValueError
        value = float(text)
    except ValueError as error:
        raise ConfigError(f"{where}: {what} = {text!r}: is no number; correct the file") from error
    if not math.isfinite(value):
        raise ConfigError(f"{where}: {what} = {text}: is not a finite number; correct the file")
    return value


def numbers_of(values: Mapping[str, float]) -> Numbers:
    """Return the six numbers by role as Numbers."""
    return Numbers(np.array([values[role] for role in "xyz"]), values["roll"], values["pitch"], values["yaw"])


def one(found: list[str] | list[tuple[str, ...]], what: str, where: str) -> tuple[str, ...]:
    """Return the only entry that was found; raise ConfigError if there is none or there are several."""
    if not found:
        raise ConfigError(f"{where}: has no {what}; is it the file meant, and whole?")
    if len(set(found)) > 1:
        raise ConfigError(
            f"{where}: has {len(found)} different {what}; leave one, for poolcal reads one head at a time"
        )
    return (found[0],) if isinstance(found[0], str) else found[0]


def whole_lines(text: str, where: str) -> list[str]:
    """Return the lines of a text; raise ConfigError if the last has no end, for a number may then be cut off."""
    if text and not text.endswith("\n"):
        raise ConfigError(f"{where}: ends within a line: it may be cut off; end the last line")
    return text.splitlines()


def written_for(convention: Convention, role: str, value: float, decimals: int) -> str:
    """Return a number of a mount as text; a heading from 0 to 360° that rounds to 360 is 0."""
    if role == "yaw" and convention.zero_to_360:
        value = round(value, decimals) % 360.0
    return written(value, decimals)


def written(value: float, decimals: int) -> str:
    """Return a number as text with fixed decimals; a value that rounds to zero has no sign.

    >>> written(-0.00001, 4), written(2.5, 1)
    ('0.0000', '2.5')
    """
    return f"{round(value, decimals) + 0.0:.{decimals}f}"
