"""Text for people: safe letters, numbers with their sign, and plurals."""


def printable(text: str) -> str:
    r"""Return the text with control characters escaped: names in files may contain them, and a terminal obeys them.

    >>> printable("a\x1b[2Jb")
    'a\\x1b[2Jb'
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def signed(value: float, digits: int) -> str:
    """Return a number as text with its sign. A value that is rounded to zero has a plus.

    >>> signed(-0.0004, 3), signed(-0.0006, 3)
    ('+0.000', '-0.001')
    """
    return f"{round(value, digits) + 0.0:+.{digits}f}"


def plural(number: int, noun: str) -> str:
    """Return a count and its noun as text, the noun in singular or plural.

    >>> plural(1, "file"), plural(2, "pass"), plural(3, "study"), plural(0, "day")
    ('1 file', '2 passes', '3 studies', '0 days')
    """
    if number == 1:
        return f"1 {noun}"
    if noun.endswith(("s", "x", "ch", "sh")):
        return f"{number} {noun}es"
    if noun.endswith("y") and noun[-2] not in "aeiou":
        return f"{number} {noun[:-1]}ies"
    return f"{number} {noun}s"
