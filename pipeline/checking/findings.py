"""A finding of poolcal check: one line."""

from dataclasses import dataclass
from typing import Literal

Severity = Literal["fault", "look"]  # look: may be meant, and does not change the status


@dataclass(frozen=True)
class Finding:
    """What is wrong, where, with which value, and what to do.

    Attributes
    ----------
    question : str
        The question that led to it: a word for programs.
    words : str
        The line for people.
    severity : {"fault", "look"}
        Whether it has to be mended, or only looked at.
    """

    question: str
    words: str
    severity: Severity = "fault"
