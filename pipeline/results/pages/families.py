"""Colours and markers of the families of faces."""

from collections.abc import Mapping, Sequence
from itertools import cycle, islice
from typing import TypeVar

T = TypeVar("T")


def styles_of_families(names: Sequence[str], standard: Mapping[str, T]) -> dict[str, T]:
    """Return a colour or marker for each family.

    A family in ``standard`` (P1, P2, P3, H) gets its standard style. The other families get the unused styles in turn.
    """
    unused = [style for name, style in standard.items() if name not in names] or list(standard.values())
    others = [name for name in names if name not in standard]
    spare = dict(zip(others, islice(cycle(unused), len(others)), strict=True))
    return {name: standard[name] if name in standard else spare[name] for name in names}
