"""Pings that a file holds twice: a logger that heard each packet on two ways, or a file that was copied behind itself.

Each sounding would count twice, and the sigmas would be too small, without a word. A repeated ping has the same bytes
as one before it, its time among them.
"""

from collections import Counter
from dataclasses import dataclass, field
from hashlib import blake2b


@dataclass
class Repeats:
    """Of one file; of each of its pings eight bytes are kept."""

    seen: set[bytes] = field(default_factory=set)

    def is_new(self, record: bytes, dropped: Counter[str]) -> bool:
        """Whether no ping before had these bytes; one that had is counted."""
        mark = blake2b(record, digest_size=8).digest()
        if mark in self.seen:
            dropped["repeated ping"] += 1
            return False
        self.seen.add(mark)
        return True
