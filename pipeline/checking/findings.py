"""A finding of poolcal check: one line."""

from dataclasses import dataclass
from typing import Literal

Severity = Literal["fault", "look"]  # look: may be intended, and does not change the exit status


@dataclass(frozen=True)
class Finding:
    """A finding: the fault, its place, the value, and the remedy.

    Attributes
    ----------
    question : str
        The check that found it: a word for programs.
    words : str
        The line for people.
    severity : {"fault", "look"}
        ``fault``: must be mended; ``look``: may be intended.
    """

    question: str
    words: str
    severity: Severity = "fault"
