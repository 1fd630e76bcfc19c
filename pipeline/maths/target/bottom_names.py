"""Names of the pieces of the bottom among the families of a target, which are many, and told as one."""

BOTTOM = "bottom-"  # names of the pieces begin so
PIECES = BOTTOM.rstrip("-")  # what they are called together


def shown_name(family: str) -> str:
    """Return the name under which a family is told, where the pieces of the bottom are one.

    >>> shown_name("bottom-7"), shown_name("bottom-left"), shown_name("wall-7")
    ('bottom', 'bottom-left', 'wall-7')
    """
    return PIECES if family.startswith(BOTTOM) and family.removeprefix(BOTTOM).isdigit() else family
