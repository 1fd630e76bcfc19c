"""A finding of poolcal check: one line."""

from dataclasses import dataclass
from typing import Literal

Severity = Literal["fault", "look"]  # look: may be intended, and does not change the exit status


@dataclass(frozen=True)
class Finding:
    """One fault or doubt: the file or sensor, the value, and the remedy.

    Attributes
    ----------
    question : str
        Code of the question that led to the finding, for programs.
    words : str
        The line for people.
    severity : {"fault", "look"}
        ``fault``: must be corrected; ``look``: may be intended.
    """

    question: str
    words: str
    severity: Severity = "fault"
