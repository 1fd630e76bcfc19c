"""What the names of a target's families stand for, in one sentence, from the faces themselves: for any target."""

import numpy as np

from pipeline.maths.target.model import Family, TargetModel, names_in_order

MANY = 4  # families of wet faces alone, such as pieces of the bottom: from so many on they are only counted
ACROSS_DEG = 95.0  # a face turned by more looks at the boat from its other side
STRAIGHT_DEG = 10.0  # a face turned, or leaning, by less looks straight at the boat that passes


def families_in_words(model: TargetModel) -> str:
    """Return a sentence with the number of faces of each family and the way they look.

    The boat passes the target at x < 0; toward +y it has the target to starboard (CONVENTIONS.md). A face with the
    outward normal n is turned by atan2(n_y, -n_x) from the direction -x that looks straight at the boat: ahead toward
    +y, astern toward -y. One turned by more than a right angle stands across the boat. It looks up by asin(n_z), down
    if that is negative. Families of one face and of several are told alike; horizontal ones are tops and bottoms.
    """
    families = names_in_order(model.families)
    alone = {one.name for one in families if model.faces and all(model.faces[k].seen == "wet" for k in one.faces)}
    few = len(alone) < MANY
    parts = [f"{family.name}: {_faces(family)}" for family in families if few or family.name not in alone]
    parts += [] if few else [f"{len(alone)} more that the sonar alone sees"]
    return f"Faces, as seen from the passing boat: {'; '.join(parts)}"


def _faces(family: Family) -> str:
    count = f"{len(family.faces)} {'face' if len(family.faces) == 1 else 'faces'}"
    if family.level:
        return f"{count}, horizontal (tops and bottoms)"
    turned = float(np.degrees(np.arctan2(family.normal[1], -family.normal[0])))
    upwards = float(np.degrees(np.arcsin(np.clip(family.normal[2], -1.0, 1.0))))
    across = abs(turned) > ACROSS_DEG
    aside = 180.0 - abs(turned) if across else abs(turned)
    way = "ahead (+y)" if turned > 0 else "astern (-y)"
    if aside >= STRAIGHT_DEG:
        words = f"{count} turned {aside:.0f}° {way}"
        if across:
            words = f"{count} across the boat, turned {aside:.0f}° {way}"
    else:
        words = f"{count} across the boat, straight towards it" if across else f"{count} straight towards the boat"
    if abs(upwards) < STRAIGHT_DEG:
        return words
    return f"{words}, looking up by {upwards:.0f}°" if upwards > 0 else f"{words}, looking down by {-upwards:.0f}°"
