"""Pings that a file holds twice: a logger that heard each packet on two ways, or a file that was copied behind itself.

Each sounding would count twice, and the sigmas would be too small, without a word. A repeated ping has the same bytes
as an earlier one, its time among them.
"""

from collections import Counter
from dataclasses import dataclass, field
from hashlib import blake2b


@dataclass
class RepeatedPings:
    """Recognises the repeated pings of one file; keeps eight bytes for each ping."""

    digests: set[bytes] = field(default_factory=set)

    def is_new(self, record: bytes, dropped: Counter[str]) -> bool:
        """Return whether no earlier ping had these bytes; otherwise count the ping in ``dropped``."""
        digest = blake2b(record, digest_size=8).digest()
        if digest in self.digests:
            dropped["repeated ping"] += 1
            return False
        self.digests.add(digest)
        return True
