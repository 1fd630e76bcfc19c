"""A run's families of faces, and how each is shown."""

from collections.abc import Mapping, Sequence
from itertools import cycle, islice
from typing import TypeVar

import pandas as pd

from pipeline.maths.target.model import LEVEL, ROLES

T = TypeVar("T")


def families_of(faces: pd.DataFrame) -> list[str]:
    """Their names: roles first, level ones last, else in order of the faces."""
    level = dict(zip(faces["family"], faces["normal_z_target_1"].abs() > LEVEL, strict=True))

    def place(name: str) -> int:
        return ROLES.index(name) if name in ROLES else len(ROLES) + bool(level[name])

    return sorted(dict.fromkeys(faces["family"].tolist()), key=place)


def level_families(faces: pd.DataFrame) -> set[str]:
    """The horizontal ones."""
    return set(faces.loc[faces["normal_z_target_1"].abs() > LEVEL, "family"])


def shown_as(names: Sequence[str], usual: Mapping[str, T]) -> dict[str, T]:
    """A colour, or a mark, of each: the ``usual`` one of P1, P2, P3 and H, in turn those that are left of others."""
    free = [value for name, value in usual.items() if name not in names] or list(usual.values())
    others = [name for name in names if name not in usual]
    spare = dict(zip(others, islice(cycle(free), len(others)), strict=True))
    return {name: usual[name] if name in usual else spare[name] for name in names}
