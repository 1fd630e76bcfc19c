r"""The patent's target from its letters a, b, c, e: outlines of the faces, and relations between their planes.

Seen from above (the boat passes on the left, x < 0, y upward)::

        pool wall x = c
     .------------------.   y =  b/2 + c
      \   P3 blocks      |
       \                 |
        |  P2            |   y in [-b/2, b/2], x = 0: the centre wall's front face
       /                 |
      /   P1 blocks      |
     '------------------'   y = -b/2 - c
"""

from dataclasses import dataclass

import numpy as np

from pipeline.maths.target.outlines import Outline, Relation

Corner = tuple[float, float, float]
HORIZONTAL_FAMILY = "H"  # name of the family of all tops and bottoms


@dataclass(frozen=True)
class PatentDimensions:
    """The letters of the patent's target, in metres; CONVENTIONS.md, "The target".

    Parameters
    ----------
    a, b
        Height and width of the centre wall.
    c
        Legs of a block's right-angled triangle.
    e
        Height of a block, and the gap to the next block above.
    low_side
        Side whose lowest block stands lower, "south" (-y) or "north" (+y).
    blocks_per_side
        Number of blocks on each side, default the whole part of a / 2e.
    first_base_m
        Height of the base of the low side's lowest block, default -a/2.
    stagger_m
        Height of the other side's lowest base above it, default e.
    """

    a: float
    b: float
    c: float
    e: float
    low_side: str = "south"
    blocks_per_side: int | None = None
    first_base_m: float | None = None
    stagger_m: float | None = None


def patent_outlines(dimensions: PatentDimensions) -> tuple[list[Outline], list[Relation], float]:
    """Return the outlines, the relations, and the height (m) after which they repeat, in the target frame.

    A block on side s = ±1 (+1 is north, +y) is the prism of height e over the triangle (0, s b/2), (c, s b/2),
    (c, s (b/2 + c)). Its measured face runs at 45° from the wall's edge back to the pool's wall; its outward normal is
    (-1, s, 0)/√2. P1 are the faces on -y, P3 those on +y, P2 the wall's front. The low side's first base stands at
    ``first_base_m`` (default -a/2), the other side's ``stagger_m`` (default e) higher. A block follows every 2 e.
    """
    a, b, c, e = dimensions.a, dimensions.b, dimensions.c, dimensions.e
    per_side, first_base_m, stagger_m = dimensions.blocks_per_side, dimensions.first_base_m, dimensions.stagger_m
    count = int(np.floor(a / (2 * e) + 1e-9)) if per_side is None else per_side
    first = -a / 2 if first_base_m is None else first_base_m
    stagger = e if stagger_m is None else stagger_m
    wall = [(0.0, b / 2, -a / 2), (0.0, -b / 2, -a / 2), (0.0, -b / 2, a / 2), (0.0, b / 2, a / 2)]
    outlines, relations = [Outline("P2", wall, "P2")], []
    level: list[str] = []
    for role, side, word in (("P1", -1, "south"), ("P3", 1, "north")):
        base = first + (0.0 if word == dimensions.low_side else stagger)
        near, inner, outer = (0.0, side * b / 2), (c, side * b / 2), (c, side * (b / 2 + c))
        names = []
        for k in range(count):
            low, high = base + 2 * e * k, base + 2 * e * k + e
            name = f"{role}-{k}"
            ends = (near, outer) if side < 0 else (outer, near)
            slanted = [(*ends[0], low), (*ends[1], low), (*ends[1], high), (*ends[0], high)]
            outlines.append(Outline(name, slanted, role))
            up = [near, inner, outer] if side > 0 else [near, outer, inner]
            outlines.append(Outline(f"{name}-top", [(*corner, high) for corner in up]))
            outlines.append(Outline(f"{name}-bottom", [(*corner, low) for corner in up[::-1]]))
            names.append(name)
            level += [f"{name}-top", f"{name}-bottom"]
        if len(names) > 1:
            relations.append(Relation("same_plane", tuple(names)))
    return outlines, [*relations, Relation("height", tuple(level), HORIZONTAL_FAMILY)], 2 * e
