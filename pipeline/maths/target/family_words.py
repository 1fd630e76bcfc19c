"""What the names of a target's families stand for, in one sentence, from the faces themselves: for any target."""

import numpy as np

from pipeline.maths.target.model import Family, TargetModel, names_in_order

STRAIGHT_DEG = 10.0  # a face turned, or leaning, by less looks straight at the boat that passes


def families_in_words(model: TargetModel) -> str:
    """Return a sentence with the number of faces of each family and the way they look.

    The boat passes the target toward +y, at x < 0, with the target to starboard (CONVENTIONS.md). A face with the
    outward normal n is turned by atan2(n_y, -n_x) from the direction -x that looks straight at the boat: ahead toward
    +y, astern toward -y. It looks up by asin(n_z), down if that is negative. Families of one face and of several are
    told alike; horizontal ones are tops and bottoms.
    """
    parts = (f"{family.name}: {_faces(family)}" for family in names_in_order(model.families))
    return f"Faces, as seen from the passing boat: {'; '.join(parts)}"


def _faces(family: Family) -> str:
    count = f"{len(family.faces)} {'face' if len(family.faces) == 1 else 'faces'}"
    if family.level:
        return f"{count}, horizontal (tops and bottoms)"
    turned = float(np.degrees(np.arctan2(family.normal[1], -family.normal[0])))
    upwards = float(np.degrees(np.arcsin(np.clip(family.normal[2], -1.0, 1.0))))
    words = f"{count} straight towards the boat"
    if abs(turned) >= STRAIGHT_DEG:
        words = f"{count} turned {abs(turned):.0f}° {'ahead (+y)' if turned > 0 else 'astern (-y)'}"
    if abs(upwards) < STRAIGHT_DEG:
        return words
    return f"{words}, looking up by {upwards:.0f}°" if upwards > 0 else f"{words}, looking down by {-upwards:.0f}°"
