"""Recognise pings that a file holds twice: the logger received each packet twice, or the file was appended to itself.

Without this check each sounding would count twice, and the sigmas would be too small without a warning. A repeated ping
has the same bytes as an earlier one, including its time.
"""

from collections import Counter
from dataclasses import dataclass, field
from hashlib import blake2b


@dataclass
class RepeatedPings:
    """The digests of one file's pings, eight bytes for each."""

    digests: set[bytes] = field(default_factory=set)

    def is_new(self, record: bytes, dropped: Counter[str]) -> bool:
        """Return whether no earlier ping of the file has the same bytes; if one has, count the ping in ``dropped``."""
        digest = blake2b(record, digest_size=8).digest()
        if digest in self.digests:
            dropped["repeated ping"] += 1
            return False
        self.digests.add(digest)
        return True
