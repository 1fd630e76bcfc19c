"""XML written and read: comments that cannot end early, and no document types (their entities may expand hugely)."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from pipeline.errors import ConfigError


def comment(lines: Sequence[str]) -> str:
    """Return lines as a comment. Two hyphens, which would end it, are set apart; so is a hyphen at a line's end."""
    return "<!--\n" + "\n".join(re.sub(r"-(?=-|$)", "- ", line).replace("\x00", "?") for line in lines) + "\n-->"


def root_of(text: str, where: str) -> ET.Element:
    """Return the root of an XML text; raise ConfigError on every fault. ``where``: the file."""
    if re.search(r"<!\s*(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise ConfigError(f"{where}: has a DOCTYPE, which is not read; take it out")
    try:
        return ET.fromstring(text.encode("utf-8"))
    except (ET.ParseError, ValueError, LookupError) as error:
        raise ConfigError(f"{where}: is no valid XML ({error}); is the file whole?") from error
