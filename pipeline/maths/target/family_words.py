"""What the names of a target's families stand for, in one sentence, from the faces themselves: for any kind of target."""

import numpy as np

from pipeline.maths.target.model import Family, TargetModel, names_in_order

STRAIGHT_DEG = 10.0  # a face turned by less looks straight at the boat that passes


def families_in_words(model: TargetModel) -> str:
    """Return a sentence with the number of faces of each family and the way they look.

    The boat passes the target toward +y, at x < 0, with the target to starboard (CONVENTIONS.md). A face with the
    outward normal n is turned by atan2(n_y, -n_x) from the direction -x that looks straight at the boat: ahead toward
    +y, astern toward -y. Families of one face and of several are told alike; horizontal ones are tops and bottoms.
    """
    parts = (f"{family.name}: {_faces(family)}" for family in names_in_order(model.families))
    return f"Faces, as seen from the passing boat: {'; '.join(parts)}"


def _faces(family: Family) -> str:
    count = f"{len(family.faces)} {'face' if len(family.faces) == 1 else 'faces'}"
    if family.level:
        return f"{count}, horizontal (tops and bottoms)"
    turned = float(np.degrees(np.arctan2(family.normal[1], -family.normal[0])))
    if abs(turned) < STRAIGHT_DEG:
        return f"{count} straight towards the boat"
    return f"{count} turned {abs(turned):.0f}° {'ahead (+y)' if turned > 0 else 'astern (-y)'}"
