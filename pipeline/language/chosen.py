"""The language of this process and of the processes that it starts, from option, environment or locale."""

import contextlib
import os
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from pipeline.errors import ConfigError
from pipeline.language.matching import Catalogue

ENGLISH = "en"
VARIABLE = "POOLCAL_LANG"  # environment variable; the processes that this one starts have it too
FOLDER = Path(__file__).parent


def languages() -> list[str]:
    """Return the codes of all languages, English first."""
    return [ENGLISH, *sorted(path.parent.name for path in FOLDER.glob("*/poolcal.po"))]


def choose(asked: str | None) -> None:
    """Choose the language of this process.

    Parameters
    ----------
    asked
        The language of ``--lang``; None: that of POOLCAL_LANG, else that of the locale if there is a catalogue for it.

    Raises
    ------
    ConfigError
        There is no such language.
    """
    given = asked if asked is not None else os.environ.get(VARIABLE)
    if not given:
        os.environ.pop(VARIABLE, None)
        return
    code = given.replace("_", "-").partition("-")[0].partition(".")[0].lower()
    if code not in languages():
        source = f"--lang {given}" if asked is not None else f"{VARIABLE}={given}"
        raise ConfigError(f"{source}: there is no such language; choose one of {', '.join(languages())}")
    os.environ[VARIABLE] = code


def language() -> str:
    """Return the code of the language that this process speaks."""
    if VARIABLE in os.environ:
        code = os.environ[VARIABLE]
        return code if code in languages() else ENGLISH
    locale = next((value for name in ("LC_ALL", "LC_MESSAGES", "LANG") if (value := os.environ.get(name))), "")
    code = locale.partition("_")[0].partition(".")[0].lower()
    return code if code in languages() else ENGLISH


@contextlib.contextmanager
def in_english() -> Iterator[None]:
    """Speak English for a while: the Rerun viewer, for example, has no Chinese letters."""
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = ENGLISH
    try:
        yield
    finally:
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before


def translated(text: str) -> str:
    """Return a text in the language of this process; as it is if there is no translation."""
    code = language()
    return text if code == ENGLISH else catalogue_of(code).translated(text)


def wholly_translated(text: str) -> str:
    """Return a text in the language of this process if none of it stays English; else as it is.

    A text with letters of that language is either a sentence with a name in them, or has been translated before.
    """
    code = language()
    return text if code == ENGLISH else catalogue_of(code).wholly_translated(text)


@lru_cache(maxsize=4)
def catalogue_of(code: str) -> Catalogue:
    """Return the catalogue of a language."""
    from babel.messages.pofile import read_po

    with (FOLDER / code / "poolcal.po").open("rb") as file:
        known = [entry for entry in read_po(file, locale=code) if entry.id and entry.string]
    return Catalogue({str(entry.id): str(entry.string) for entry in known})
