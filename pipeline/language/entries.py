"""The entries of a catalogue: sentences with places for values, and the sentences within them.

The translation of an entry marks some of its places. ``{0!}`` is a name: a file, a key, an option or a command, which
is typed as it stands, even if it is called ``run`` or ``laser``. ``{0#}`` is a count: ``{0} points`` is no sentence on
the points of something, and matches a number alone.
"""

import itertools
import re
from collections.abc import Mapping, Sequence

PLACE = re.compile(r"\{(\d+)\}")
MARKED = re.compile(r"\{(\d+)([!#]?)\}")  # a place of a translation
COUNT = r"[~\d.,]*\d"
NAME = r"[\[{].*(?:[\]}]|\.\.\.)|.*?"  # lists and mappings as Python writes them have colons and commas
WORD = re.compile(r"[A-Za-z]{2,}")
BEHIND = {("; ", "；"), (", ", "，")}  # what an entry begins with that is put behind another
BEGUN = re.compile(r"\{\d+\}\w")  # a sentence that begins within another


def words_of(entry: str) -> list[str]:
    """Return the words of an entry, without those that its places take.

    >>> words_of("{0} of {1} is late")
    ['of', 'is', 'late']
    """
    return WORD.findall(PLACE.sub(" ", entry))


def names_of(translation: str) -> set[int]:
    """Return the numbers of the places whose values are names.

    >>> names_of("{1!} 晚 {0}")
    {1}
    """
    return {int(number) for number, mark in MARKED.findall(translation) if mark == "!"}


def with_values(translation: str, values: Sequence[str]) -> str:
    """Return a translation with its values in their places.

    >>> with_values("{1!} 晚 {0}", ["5 ms", "laser"])
    'laser 晚 5 ms'
    """
    return MARKED.sub(lambda place: values[int(place[1])], translation)


def pattern_of(key: str, translation: str) -> re.Pattern[str]:
    """Return the expression that a text with this sentence matches; its groups are the values, by their numbers.

    Blanks match any blanks. The first letter may be large or small, because sentences are made from parts.
    """
    values = {number: {"#": COUNT, "!": NAME}.get(mark, ".*?") for number, mark in MARKED.findall(translation)}
    text = ""
    for place, piece in enumerate(PLACE.split(key)):
        words = r"\s+".join(re.escape(part) for part in re.split(r"\s+", piece))
        text += f"({values[piece]})" if place % 2 else words
    if key[0].isalpha():
        text = f"[{key[0].lower()}{key[0].upper()}]" + text[1:]
    return re.compile(text, re.DOTALL)


def sentences_of(entries: Mapping[str, str]) -> dict[str, str]:
    """Return an entry for each sentence of the entries that have several, where both languages have as many.

    A page may show some of the sentences of a text alone, or the part before a semicolon, without the advice behind it,
    or this advice alone. What goes on from a value, such as ``{1}see {2}``, is no sentence.

    >>> sentences_of({"{0} is on. {1} is off.": "{0}开。{1}关。"})
    {'{0} is on': '{0}开', '{0} is off': '{0}关'}
    """
    found: dict[str, str] = {}
    ends = [(r";\s+", "；"), (r"\.(?:\s+|$)", "。")]
    for (english_end, other_end), (key, value) in itertools.product(ends, entries.items()):
        english = [part.strip() for part in re.split(english_end, key) if part]
        other = [part.strip() for part in value.split(other_end) if part]
        if len(english) != len(other) or len(english) < 2:
            continue
        for sentence, translation in zip(english, other, strict=True):
            numbers = PLACE.findall(sentence)
            same = sorted(numbers) == sorted(number for number, _ in MARKED.findall(translation))
            if same and words_of(sentence) and not BEGUN.match(sentence):
                found[_counted(sentence, numbers)] = _counted(translation, numbers)
    behind = {key[2:]: value[1:] for key, value in entries.items() if (key[:2], value[:1]) in BEHIND}
    return behind | found


def _counted(text: str, numbers: Sequence[str]) -> str:
    """Return a text with its places numbered by their order among some numbers.

    >>> _counted("{3!} of {5}", ["5", "3"])
    '{1!} of {0}'
    """
    return MARKED.sub(lambda place: f"{{{numbers.index(place[1])}{place[2]}}}", text)
