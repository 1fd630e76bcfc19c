"""Find the sentence of a catalogue that a text is, and put its values into the translation.

An entry of the catalogue is a sentence with places for values, such as ``{0} scatter {1} times as much as {2} says``.
A text matches it if it has the same words with any values between them. The values are translated in the same way,
except names (:mod:`pipeline.language.entries`).
Where several entries match, the one that leaves the fewest words untranslated is taken, and of these the one with the
most words of its own; one that leaves more words than it has matches by chance, and is not taken. A text that no
entry matches is taken apart at full stops, semicolons, colons and commas, and its parts are translated; but a
sentence of which a third would remain English stays English.
"""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import NamedTuple

from pipeline.language.entries import PLACE, WORD, names_of, pattern_of, sentences_of, with_values, words_of

PLAIN = re.compile(  # a word of a sentence: no unit, and no part of a path or of a key
    r"(?<![\w./:=-])(?!(?:mm|cm|km|ms|min|deg)\b)[a-z]{2,}(?![\w/:=-]|\.\w)"
)
SENTENCE = re.compile(r"(?<![\w./])[a-z]{2,} [a-z]{2,} [a-z]{2,}(?![\w./])")
DATA = re.compile(r"[\[{'\"]")  # lists and texts as Python writes them: colons within them are no colons of a sentence
BREAKS = {  # where a text may be taken apart, coarse ones first, and what stands there then
    "\n": "\n", ". ": "。", "; ": "；", ": ": "：", ", ": "，", " and ": "、", " or ": "或",
}  # fmt: skip
BRACKET = re.compile(r"([^()]*) \(([^()]*)\)(.*)", re.DOTALL)
NUMBER = re.compile(  # words before a number, or behind it
    r"([A-Za-z][A-Za-z, ]*?|[-+±]?\d[^A-Za-z]*) ((?<=[a-z] )[-+±]?\d.*|(?<![a-z] )[A-Za-z].*)", re.DOTALL
)
ITEM = re.compile(r"\d+\. ")  # of a list, its number before it
SPEAKER = "poolcal: "
FULL_STOP = {".": "。", ":": "：", ";": "；", "?": "？", "!": "！"}
MOST_LETTERS = 5000  # of a text that is taken apart: longer ones are data


class Found(NamedTuple):
    """A text in the other language, and how many of its words are still English."""

    text: str
    left: int


class Catalogue:
    """Translations by sentence.

    Parameters
    ----------
    entries
        Translations by English sentence. The places ``{0}``, ``{1}`` of a sentence stand in its translation too, in any
        order, those of names as ``{0!}``, of counts as ``{0#}``.
    """

    def __init__(self, entries: Mapping[str, str]) -> None:
        entries = sentences_of(entries) | dict(entries)
        self._exact = {key: value for key, value in entries.items() if not PLACE.search(key)}
        with_places = (key for key in entries if PLACE.search(key) and words_of(key))
        self._patterns = {key: (pattern_of(key, entries[key]), entries[key]) for key in with_places}
        self._by_word: dict[str, list[str]] = defaultdict(list)
        words = {key: [word.lower() for word in words_of(key)] for key in self._patterns}
        counts: dict[str, int] = defaultdict(int)
        for word in (word for own in words.values() for word in set(own)):
            counts[word] += 1
        for key, own in words.items():
            self._by_word[min(own, key=lambda word: (counts[word], word))].append(key)
        self._found = lru_cache(maxsize=20_000)(self._find)

    def translated(self, text: str) -> str:
        """Return the text in the other language; what the catalogue does not have stays English."""
        return self._found(text).text

    def wholly_translated(self, text: str) -> str:
        """Return the text in the other language if no word of it stays English; else as it is."""
        found = self._found(text)
        return text if found.left else found.text

    def _find(self, text: str) -> Found:
        core = text.strip()
        if not WORD.search(core) or len(core) > MOST_LETTERS:
            return _english(text)
        found = self._sentence(core)
        begin, end = text[: len(text) - len(text.lstrip())], text[len(text.rstrip()) :]
        return Found(f"{begin}{found.text}{end}", found.left)

    def _sentence(self, core: str) -> Found:
        if core.startswith(SPEAKER) and core not in self._exact:  # of every complaint: it is no part of the sentence
            return _joined(Found(SPEAKER[:-2], 0), BREAKS[": "], self._found(core.removeprefix(SPEAKER)))
        if number := ITEM.match(core):
            return _joined(Found(number[0], 0), "", self._found(core[number.end() :]))
        found = self._whole(core)
        stop = FULL_STOP.get(core[-1], "")
        if stop and len(core) > 1 and core not in self._exact and (found is None or found.text[-1] != stop):
            before = self._whole(core[:-1].rstrip())  # without its full stop, which may have gone into a value
            if before is not None and (found is None or before.left <= found.left):
                found = Found(before.text + stop, before.left)
        if found is not None:
            return found
        for mark in ("\n", ". "):
            if mark in core.strip(mark):
                first, second = core.split(mark, 1)
                if mark == ". " and (found := self._whole(f"{first}.")) is not None:  # an entry with its full stop
                    return _joined(found, "", self._found(second))
                return _joined(self._found(first), BREAKS[mark], self._found(second))
        apart = self._taken_apart(core)
        if stop and re.search(r"[\u4e00-\u9fff）].$", apart.text):
            apart = Found(apart.text[:-1] + stop, apart.left)
        left, words = apart.left, len(PLAIN.findall(core))
        return _english(core) if left > 1 and 3 * left > words else apart  # half a sentence is worse than none

    def _taken_apart(self, core: str) -> Found:
        """Return a sentence with its parts translated, each by itself."""
        bracket = BRACKET.fullmatch(core)
        if bracket is not None and not bracket[3] and (before := self._whole(bracket[1])) is not None:
            return _joined(before, "", self._bracket(bracket[2]))
        tried = ((self._whole(core[:place]), place) for place in reversed(_outside_brackets(core, "; ")))
        if whole := [(found, place) for found, place in tried if found is not None]:
            found, place = min(whole, key=lambda one: one[0].left)  # of equal ones the longest
            return _joined(found, BREAKS["; "], self._found(core[place + 2 :]))
        marks = sorted(("; ", ": "), key=lambda mark: (_outside_brackets(core, mark) or [len(core)])[0])
        for mark in (*marks, ", "):  # what stands before a colon belongs to all behind it
            places = _outside_brackets(core, mark)
            for place in places:
                if (known := self._with_mark(core[:place], mark)) is not None:
                    return _joined(known, "", self._found(core[place + len(mark) :]))
            if places:
                return self._in_two(core, places[0], mark)
        if bracket is not None:
            return _joined(_joined(self._found(bracket[1]), "", self._bracket(bracket[2])), "", self._found(bracket[3]))
        for mark in BREAKS:
            if mark in core.strip(mark):
                return self._in_two(core, core.find(mark), mark)
        number = NUMBER.fullmatch(core)
        return _joined(self._found(number[1]), " ", self._found(number[2])) if number else _english(core)

    def _bracket(self, inside: str) -> Found:
        """Return what stands in brackets, with them."""
        found = self._found(inside)
        return self._whole(f"({inside})") or Found(f"（{found.text}）", found.left)

    def _in_two(self, core: str, place: int, mark: str) -> Found:
        """Return a text translated in two parts, before and behind a mark."""
        return _joined(self._found(core[:place]), BREAKS[mark], self._found(core[place + len(mark) :]))

    def _with_mark(self, part: str, mark: str) -> Found | None:
        """Return the translation of a part by an entry that ends with a mark, or None."""
        found = self._whole(part + mark.rstrip())
        return found if found is not None and found.text[-1] == BREAKS[mark] else None

    def _whole(self, core: str) -> Found | None:
        """Return the translation of a text that one entry of the catalogue matches as a whole, or None."""
        for form in dict.fromkeys((core, core[0].lower() + core[1:], core[0].upper() + core[1:])):
            if form in self._exact:
                return Found(self._exact[form], 0)
        best: tuple[int, int, Found] | None = None
        for key in self._candidates(core):
            pattern, translation = self._patterns[key]
            match = pattern.fullmatch(core)
            if match is None or not _are_values(match, translation):
                continue
            names = names_of(translation)
            own = len(words_of(key))
            parts = [
                _name(value, own) if k in names else _close(self._found(value))
                for k, value in enumerate(match.groups())
            ]
            left = sum(part.left for part in parts)
            if left > own or (left == own == 1):  # it matches by chance
                continue
            if best is None or (-left, own) > best[:2]:
                best = (-left, own, Found(with_values(translation, [part.text for part in parts]), left))
        return best[2] if best else None

    def _candidates(self, core: str) -> Iterator[str]:
        for word in dict.fromkeys(WORD.findall(core.lower())):
            yield from self._by_word.get(word, ())


def _english(text: str) -> Found:
    """Return a text as it is."""
    return Found(text, len(PLAIN.findall(text)))


def _joined(first: Found, mark: str, second: Found) -> Found:
    return Found(f"{first.text}{mark}{second.text}", first.left + second.left)


def _name(value: str, own: int) -> Found:
    """Return a name as it is: no words are left in it, unless it reads like a sentence.

    Beside a single word of an entry, such as ``{0} against {1}``, two words make a sentence; else three.

    >>> _name("ingest, segment", 2).left, _name("is late by it", 2).left, _name("check it", 1).left
    (0, 4, 2)
    """
    return _english(value) if SENTENCE.search(value) or (own == 1 and " " in value) else Found(value, 0)


def _close(part: Found) -> Found:
    """Return a part without blanks beside Chinese marks and behind Chinese words, which need none.

    >>> _close(Found("是否为 x？ ", 0)).text, _close(Found(" （y）", 0)).text, _close(Found("z ", 0)).text
    ('是否为 x？', '（y）', 'z ')
    """
    return Found(re.sub(r"^\s+(?=[（，；：])|(?<=[\u4e00-\u9fff，。；：？！、）])\s+$", "", part.text), part.left)


def _are_values(match: re.Match[str], translation: str) -> bool:
    """Return whether a match gives each place a value, and not more of the sentence that goes on behind it.

    A name ends at a semicolon or colon. Brackets are whole. What holds a semicolon stands before a mark or at the end
    in the other language too, so that its parts are not moved into the midst of another sentence.
    """
    names = names_of(translation)
    for number, value in enumerate(match.groups()):
        leading = match.start(number + 1) == 0
        if number in names and _goes_on(value, leading):
            return False
        if not _is_whole(value) or (leading and (value.rstrip().endswith(":") or value.startswith((",", ";")))):
            return False
        if "; " in value and not re.search(rf"\{{{number}[!#]?\}}(?:[，。；：）{{]|$)", translation):
            return False
    return True


def _goes_on(name: str, leading: bool) -> bool:
    """Return whether a value goes on past the end of a name: into another part of the sentence.

    >>> _goes_on("a.xtf", True), _goes_on("poolcal: a.xtf", True), _goes_on("{'x_m': 1}", False)
    (False, True, False)
    """
    return "; " in name or (": " in name and (leading or not DATA.search(name)))


def _is_whole(value: str) -> bool:
    """Return whether each bracket in a value is opened before it is closed, and is closed.

    >>> _is_whole("a (b)"), _is_whole("SIGSEGV); see a (2 s")
    (True, False)
    """
    depth = 0
    for letter in value:
        depth += (letter == "(") - (letter == ")")
        if depth < 0:
            return False
    return depth == 0


def _outside_brackets(core: str, mark: str) -> list[int]:
    """Return the places of a mark at which a text may be taken apart: in no brackets, with text on both sides.

    >>> _outside_brackets("noise (a, b), clocks", ", "), _outside_brackets("noise (a, b)", ", ")
    ([12], [])
    """
    found = []
    place = core.find(mark)
    while place >= 0:
        before = core[:place]
        if before.strip() and core[place + len(mark) :].strip() and before.count("(") == before.count(")"):
            found.append(place)
        place = core.find(mark, place + 1)
    return found
