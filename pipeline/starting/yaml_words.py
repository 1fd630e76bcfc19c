"""Pieces of YAML text: values in quotes where YAML needs them, and comments that cannot end before their line does."""

import textwrap
from collections.abc import Sequence

import yaml

from pipeline.config.fill_in import MARK, what
from pipeline.console import printable

_COMMENT_COLUMN = 30  # at which comments beside keys begin
_LONGEST = 120
_WIDTH = 116
_NEVER_BROKEN = 1_000_000


def scalar(text: str) -> str:
    """Return a text as a YAML value of one line.

    >>> scalar("ins/*.gps"), scalar("船: 1"), scalar("2026"), scalar("it's #1")
    ('ins/*.gps', "'船: 1'", "'2026'", "'it''s #1'")
    """
    if not text.isprintable():
        return _in_quotes(text)
    return yaml.safe_dump(text, allow_unicode=True, width=_NEVER_BROKEN).removesuffix("...\n").strip()


def _in_quotes(text: str) -> str:
    return yaml.safe_dump(text, default_style='"', width=_NEVER_BROKEN).strip()


def file_list(patterns: Sequence[str], indent: str = "  ") -> str:
    """Return the value of a key that lists files: in brackets if it is one, else one a line below the key."""
    if len(patterns) == 1:
        return list_in_brackets(patterns)
    return "".join(f"\n{indent}  - {scalar(pattern)}" for pattern in patterns)


def list_in_brackets(patterns: Sequence[str]) -> str:
    """Return texts as a YAML list on one line.

    >>> list_in_brackets(["ins/*.gps", "a,b"])
    '[ins/*.gps, "a,b"]'
    """
    bare = [(pattern, scalar(pattern)) for pattern in patterns]
    return f"[{', '.join(_in_quotes(text) if _has_meaning(inner) else inner for text, inner in bare)}]"


def _has_meaning(inner: str) -> bool:
    """Return whether a value without quotes has letters that have a meaning in a list in brackets."""
    return inner[:1] not in ("'", '"') and bool(set(inner) & set(",[]{}"))


def comment(text: str, indent: str = "") -> list[str]:
    """Return a text as lines of comments, with control characters escaped."""
    width = _WIDTH - len(indent)
    lines = textwrap.wrap(printable(text), width, break_long_words=False, break_on_hyphens=False)
    return [f"{indent}# {line}" for line in lines]


def to_fill_in(name: str, indent: str, key: str = "") -> str:
    """Return the line of a key that a person must fill in, with a comment on what that is.

    Parameters
    ----------
    name
        The key.
    indent
        Blanks before it.
    key
        The key with the blocks round it, by which the words are looked up; empty: ``name``.
    """
    return beside(f"{indent}{name}: {MARK}", what(key or name))


def beside(line: str, words: str) -> str:
    """Return a line of YAML with a comment beside it, or above it where both are too long for one line.

    >>> beside("  x_m: 0.3", "forward")
    '  x_m: 0.3                    # forward'
    """
    whole = f"{line:<{_COMMENT_COLUMN}}# {words}"
    indent = " " * (len(line) - len(line.lstrip()))
    return whole if len(whole) <= _LONGEST else "\n".join([*comment(words, indent), line])
