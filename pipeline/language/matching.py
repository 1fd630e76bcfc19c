"""Find the sentence of a catalogue that a text is, and put its values into the translation.

An entry of the catalogue is a sentence with places for values, such as ``{0} scatter {1} times as much as {2} says``.
A text matches it if it has the same words with any values between them. The values are translated in the same way,
except those that the translation marks as names, ``{0!}``: a file, a key, an option is typed as it stands, even if it is
called ``run`` or ``laser``.
Where several entries match, the one that leaves the fewest words untranslated is taken, and of these the one with the
most words of its own; one that leaves more words than it has matches by chance, and is not taken. A text that no
entry matches is taken apart at full stops, semicolons, colons and commas, and its parts are translated; but a
sentence of which a third would remain English stays English.
"""

import itertools
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache

PLACE = re.compile(r"\{(\d+)\}")
MARKED = re.compile(r"\{(\d+)(!?)\}")  # a place of a translation; with ! its value is a name, which stays as it is
WORD = re.compile(r"[A-Za-z]{2,}")
PLAIN = re.compile(  # a word of a sentence: no unit, and no part of a path or of a key
    r"(?<![\w./:=-])(?!(?:mm|cm|km|ms|min|deg)\b)[a-z]{2,}(?![\w/:=-]|\.\w)"
)
SENTENCE = re.compile(r"(?<![\w./])[a-z]{2,} [a-z]{2,} [a-z]{2,}(?![\w./])")
BREAKS = {  # where a text may be taken apart, coarse ones first, and what stands there then
    "\n": "\n", ". ": "。", "; ": "；", ": ": "：", ", ": "，", " and ": "、", " or ": "或",
}  # fmt: skip
BRACKET = re.compile(r"([^()]*) \(([^()]*)\)(.*)", re.DOTALL)
NUMBER = re.compile(  # words before a number, or behind it
    r"([A-Za-z][A-Za-z, ]*?|[-+±]?\d[^A-Za-z]*) ((?<=[a-z] )[-+±]?\d.*|(?<![a-z] )[A-Za-z].*)", re.DOTALL
)
FULL_STOP = {".": "。", ":": "：", ";": "；", "?": "？", "!": "！"}
MOST_LETTERS = 5000  # of a text that is taken apart: longer ones are data


class Catalogue:
    """Translations by sentence.

    Parameters
    ----------
    entries
        Translations by English sentence. The places ``{0}``, ``{1}`` of a sentence stand in its translation too, in any
        order, those of names as ``{0!}``.
    """

    def __init__(self, entries: Mapping[str, str]) -> None:
        entries = sentences_of(entries) | dict(entries)
        self._exact = {key: value for key, value in entries.items() if not PLACE.search(key)}
        with_places = (key for key in entries if PLACE.search(key) and WORD.search(PLACE.sub(" ", key)))
        self._patterns = {key: (_pattern(key), entries[key]) for key in with_places}
        self._by_word: dict[str, list[str]] = defaultdict(list)
        counts: dict[str, int] = defaultdict(int)
        for key in self._patterns:
            for word in set(WORD.findall(PLACE.sub(" ", key).lower())):
                counts[word] += 1
        for key in self._patterns:
            words = WORD.findall(PLACE.sub(" ", key).lower())
            rarest = min(words, key=lambda word: (counts[word], word))
            self._by_word[rarest].append(key)
        self.translated = lru_cache(maxsize=20_000)(self._translated)

    def _translated(self, text: str) -> str:
        """Return the text in the other language; what the catalogue does not have stays English."""
        core = text.strip()
        if not WORD.search(core) or len(core) > MOST_LETTERS:
            return text
        begin = text[: len(text) - len(text.lstrip())]
        end = text[len(text.rstrip()) :]
        return f"{begin}{self._core(core)}{end}"

    def _core(self, core: str) -> str:
        found = self._whole(core)
        if found is not None:
            return found
        if core[-1] in FULL_STOP and len(core) > 1 and (found := self._whole(core[:-1].rstrip())) is not None:
            return found + FULL_STOP[core[-1]]
        for mark in ("\n", ". "):
            if mark in core.strip(mark):
                first, second = core.split(mark, 1)
                if mark == ". " and (found := self._whole(f"{first}.")) is not None:  # an entry with its full stop
                    return f"{found}{self.translated(second)}"
                return f"{self.translated(first)}{BREAKS[mark]}{self.translated(second)}"
        taken_apart = self._taken_apart(core)
        left, words = len(PLAIN.findall(taken_apart)), len(PLAIN.findall(core))
        return core if left > 1 and 3 * left > words else taken_apart  # half a sentence is worse than none

    def _taken_apart(self, core: str) -> str:
        """Return a sentence with its parts translated, each by itself."""
        for mark in ("; ", ": ", ", "):
            place = _outside_brackets(core, mark)
            if place:
                rest = core[place + len(mark) :]
                return f"{self.translated(core[:place])}{BREAKS[mark]}{self.translated(rest)}"
        bracket = BRACKET.fullmatch(core)
        if bracket is not None:
            before, inside, after = bracket.groups()
            return f"{self.translated(before)}（{self.translated(inside)}）{self.translated(after)}"
        for mark in BREAKS:
            if mark in core.strip(mark):
                first, second = core.split(mark, 1)
                return f"{self.translated(first)}{BREAKS[mark]}{self.translated(second)}"
        number = NUMBER.fullmatch(core)
        return f"{self.translated(number[1])} {self.translated(number[2])}" if number else core

    def _whole(self, core: str) -> str | None:
        """Return the translation of a text that one entry of the catalogue matches as a whole, or None."""
        for form in dict.fromkeys((core, core[0].lower() + core[1:], core[0].upper() + core[1:])):
            if form in self._exact:
                return self._exact[form]
        best: tuple[int, int, str] | None = None
        for key in self._candidates(core):
            pattern, translation = self._patterns[key]
            match = pattern.fullmatch(core)
            if match is None:
                continue
            names = {int(number) for number, mark in MARKED.findall(translation) if mark}
            values = [value if k in names else self.translated(value) for k, value in enumerate(match.groups())]
            left = sum(_words_left(value, k in names) for k, value in enumerate(values))
            own = len(WORD.findall(PLACE.sub(" ", key)))
            if left > own:  # it matches by chance
                continue
            result = _with_values(translation, values)
            if best is None or (-left, own) > best[:2]:
                best = (-left, own, result)
        return best[2] if best else None

    def _candidates(self, core: str) -> Iterator[str]:
        for word in dict.fromkeys(WORD.findall(core.lower())):
            yield from self._by_word.get(word, ())


def _outside_brackets(core: str, mark: str) -> int:
    """Return the place of a mark at which a text may be taken apart: in no brackets, with text on both sides; else 0.

    >>> _outside_brackets("noise (a, b), clocks", ", "), _outside_brackets("noise (a, b)", ", ")
    (12, 0)
    """
    place = core.find(mark)
    while place >= 0:
        before = core[:place]
        if before.strip() and core[place + len(mark) :].strip() and before.count("(") == before.count(")"):
            return place
        place = core.find(mark, place + 1)
    return 0


def _with_values(translation: str, values: Sequence[str]) -> str:
    """Return a translation with its values in their places."""
    return MARKED.sub(lambda place: values[int(place[1])], translation)


def _words_left(value: str, is_name: bool) -> int:
    """Return how many words of a sentence a value has. Names have none, unless they read like a sentence.

    >>> _words_left("ingest, segment", is_name=True), _words_left("is late by it", is_name=True)
    (0, 4)
    """
    return 0 if is_name and not SENTENCE.search(value) else len(PLAIN.findall(value))


def _pattern(key: str) -> re.Pattern[str]:
    """Return the expression that a text with this sentence matches; its groups are the values, by their numbers.

    Blanks match any blanks. The first letter may be large or small, because sentences are made from parts.
    """
    pieces = PLACE.split(key)
    out = []
    for place, piece in enumerate(pieces):
        out.append("(.*?)" if place % 2 else r"\s+".join(re.escape(part) for part in re.split(r"\s+", piece)))
    text = "".join(out)
    if key[0].isalpha():
        text = f"[{key[0].lower()}{key[0].upper()}]" + text[1:]
    return re.compile(text, re.DOTALL)


def sentences_of(entries: Mapping[str, str]) -> dict[str, str]:
    """Return an entry for each sentence of the entries that have several, where both languages have as many.

    A page may show some of the sentences of a text alone, or the part before a semicolon, without the advice behind it.

    >>> sentences_of({"{0} is on. {1} is off.": "{0}开。{1}关。"})
    {'{0} is on': '{0}开', '{0} is off': '{0}关'}
    """
    found: dict[str, str] = {}
    ends = [(r";\s+", "；"), (r"\.(?:\s+|$)", "。")]
    for (english_end, other_end), (key, value) in itertools.product(ends, entries.items()):
        english = [part for part in re.split(english_end, key) if part]
        other = [part for part in value.split(other_end) if part]
        if len(english) != len(other) or len(english) < 2:
            continue
        for sentence, translation in zip(english, other, strict=True):
            numbers = PLACE.findall(sentence)
            if sorted(numbers) == sorted(number for number, _ in MARKED.findall(translation)) and WORD.search(PLACE.sub(" ", sentence)):
                new = {old: str(k) for k, old in enumerate(numbers)}
                english_sentence = PLACE.sub(lambda place, new=new: f"{{{new[place[1]]}}}", sentence.strip())
                found[english_sentence] = MARKED.sub(
                    lambda place, new=new: f"{{{new[place[1]]}{place[2]}}}", translation.strip()
                )
    return found
