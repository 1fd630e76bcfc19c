"""What was found, in one line."""

from dataclasses import dataclass
from typing import Literal

Severity = Literal["fault", "look"]  # look: may be meant, and does not change the status


@dataclass(frozen=True)
class Finding:
    """``question``: the word for programs; ``words``: what, where, the value, what to do."""

    question: str
    words: str
    severity: Severity = "fault"
