"""The message, one line, about a fault in a settings file: the key, its value, and the remedy."""

from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any

import yaml
from pydantic import BaseModel

from pipeline.config.model_fields import Location, field_names, known_keys, without_tags
from pipeline.config.yaml_file import line_of

LETTERS = tuple(f"target.{letter}" for letter in "abce")
FOOT_M = 0.3048
SENTENCES = {  # in place of pydantic's, which are for programmers
    "too_short": "has too few entries: {actual_length} of at least {min_length}",
    "string_type": "should be text: put it in quotes",
    "string_too_long": "has more than {max_length} characters",
    "too_long": "has more entries than {max_length}; a decimal comma makes two of one",
    "union_tag_invalid": "has kind {tag}, which is none of {expected_tags}",
}
OUT_OF_BOUNDS = ("less_than_equal", "greater_than_equal")


def fault_line(model: type[BaseModel], faults: Sequence[Any], where: str, root: yaml.Node | None = None) -> str:
    """Return the message about the first fault that matters.

    Parameters
    ----------
    model : type[BaseModel]
        The model that refused the file's content.
    faults : Sequence[Any]
        The faults as pydantic lists them, each a mapping with ``type``, ``loc``, ``input`` and ``msg``.
    where : str
        The file, and the block within it.
    root : yaml.Node, optional
        The content with its places in the file; without it the message has no line.
    """
    fault = _first(faults)
    where += "" if root is None else f": line {line_of(root, fault['loc'])}"
    place = without_tags(model, fault["loc"])
    key = ".".join(str(part) for part in place if part not in ("function-after", "[key]")) or "(whole file)"
    if fault["type"] == "extra_forbidden":
        known = ", ".join(known_keys(model, fault["loc"][:-1]))
        meant = _meant(str(fault["loc"][-1]), known.split(", "))
        return f"{where}: {key}: unknown key; {meant}known here: {known}"
    if fault["type"] == "missing":
        return f"{where}: {key}: is missing; {_missing(model, fault['loc'])}"
    message = SENTENCES[fault["type"]].format(**fault.get("ctx", {})) if fault["type"] in SENTENCES else fault["msg"]
    message = message.removeprefix("Value error, ").replace("a valid array", "a list, in square brackets")
    if fault["type"] == "float_type" and "," in str(fault["input"]):
        message += ", with a point where the comma is"
    message += _in_metres(key, fault) + _in_m_s(key, fault)
    shown = repr(fault["input"])
    shown = shown if len(shown) <= 60 else shown[:57] + "..."
    return f"{where}: {key} = {shown}: {message[0].lower()}{message[1:]}; correct this value"


def _first(faults: Sequence[Any]) -> Any:
    """Return the fault to report: before a missing key an unknown one beside it, which may be that key misspelt."""
    first = faults[0]
    if first["type"] != "missing":
        return first
    beside = (fault for fault in faults if fault["loc"][:-1] == first["loc"][:-1])
    return next((fault for fault in beside if fault["type"] == "extra_forbidden"), first)


def _meant(unknown: str, known: list[str]) -> str:
    """Return a hint about an unknown key: the known keys like it; an empty text if there are none.

    >>> _meant("roll", ["roll_deg", "x_m"]), _meant("mbes2", ["ins", "mbes"])
    ('is it roll_deg? ', 'write all heads under mbes, as a list of blocks; ')
    """
    bare = unknown.rstrip("0123456789_")
    if bare == "mbes" and bare != unknown and bare in known:
        return "write all heads under mbes, as a list of blocks; "
    if bare != unknown and bare in known:
        return f"one {bare} is calibrated at a time: write one session.yaml for each; "
    begun = [key for key in known if key.startswith(f"{unknown}_") or unknown.startswith(f"{key}_")]
    alike = begun or get_close_matches(unknown, known, 1, 0.75)
    return f"is it {' or '.join(alike)}? " if alike else ""


def _missing(model: type[BaseModel], location: Location) -> str:
    """Return the remedy for a missing key."""
    if location[-1] == "mount":
        keys = ", ".join(field_names(model, location))
        return f"add it with its six keys, {keys}, or let poolcal coarse write it"
    return "add it"


def _in_metres(key: str, fault: Any) -> str:
    """Return a hint if a length is out of bounds in metres, but not if read in millimetres; else an empty text."""
    value, bounds = fault["input"], fault.get("ctx", {})
    last = key.rpartition(".")[2]
    length = last.endswith("_m") or ".corners." in key or key in LETTERS
    beyond = fault["type"] in OUT_OF_BOUNDS and isinstance(value, (int, float))
    if not (length and beyond) or abs(value) / 1000 > abs(bounds.get("le", bounds.get("ge", 0.0))):
        return ""
    return f", in metres: is {value:g} in mm? It is then {value / 1000:.4g}"


def _in_m_s(key: str, fault: Any) -> str:
    """Return a hint about a sound speed out of bounds: a unit in which it is plausible, and the order of a cast's row.

    >>> _in_m_s("mbes.svp.0.1", {"type": "less_than_equal", "input": 4855.0})
    ' (m/s; is it in feet a second? It is then 1479.8); each row of svp is [depth in m, speed in m/s]'
    """
    value, row = fault["input"], "svp" in key.split(".")
    beyond = fault["type"] in OUT_OF_BOUNDS and isinstance(value, (int, float))
    if not beyond or not (row or key.endswith("sound_speed_m_s")):
        return ""
    units = ((FOOT_M, "feet a second"), (1000.0, "km/s"))
    hints = (f" (m/s; is it in {unit}? It is then {value * m:.1f})" for m, unit in units if 1300 <= value * m <= 1700)
    return next(hints, "") + ("; each row of svp is [depth in m, speed in m/s]" if row else "")
