"""What a file is found to be, and what to do with it."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Kind:
    """``format``: session.yaml's word where this program reads it, for these ``sensors``; where not, ``advice``, and
    ``advices`` where it is another for a sensor."""

    title: str
    format: str | None = None
    sensors: tuple[str, ...] = ()
    advice: str = ""
    advices: Mapping[str, str] = field(default_factory=dict)

    def advice_for(self, sensor: str) -> str:
        return self.advices.get(sensor, self.advice)
