"""Find the sentence of a catalogue that a text is, and put its values into the translation.

An entry of the catalogue is a sentence with places for values, such as ``{0} scatter {1} times as much as {2} says``.
A text matches it if it has the same words with any values between them. The values are translated in the same way.
Where several entries match, the one that leaves the fewest words untranslated is taken, and of these the one with the
most words of its own. A text that no entry matches is taken apart at semicolons, colons and commas, and its parts are
translated; what then remains stays as it is.
"""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from functools import lru_cache

PLACE = re.compile(r"\{(\d+)\}")
WORD = re.compile(r"[A-Za-z]{2,}")
BREAKS = ("\n", ". ", "; ", ": ", " (", ", ", " and ", " or ")  # where a text may be taken apart, coarse ones first
FULL_STOP = {".": "。", ":": "：", ";": "；", "?": "？", "!": "！"}
MOST_LETTERS = 5000  # of a text that is taken apart: longer ones are data


class Catalogue:
    """Translations by sentence.

    Parameters
    ----------
    entries
        Translations by English sentence. The places ``{0}``, ``{1}`` of a sentence stand in its translation too, in any
        order.
    """

    def __init__(self, entries: Mapping[str, str]) -> None:
        self._exact = {key: value for key, value in entries.items() if not PLACE.search(key)}
        self._patterns = {key: (_pattern(key), value) for key, value in entries.items() if PLACE.search(key)}
        self._by_word: dict[str, list[str]] = defaultdict(list)
        counts: dict[str, int] = defaultdict(int)
        for key in self._patterns:
            for word in set(WORD.findall(PLACE.sub(" ", key))):
                counts[word] += 1
        for key in self._patterns:
            words = WORD.findall(PLACE.sub(" ", key))
            rarest = min(words, key=lambda word: (counts[word], word), default="")
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
        parts = next(([*core.split(mark, 1), mark] for mark in BREAKS if mark in core.strip(mark)), None)
        if parts is None:
            return core
        first, second, mark = parts
        return f"{self.translated(first)}{_mark(mark)}{self.translated(second)}"

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
            values = [self.translated(value) for value in match.groups()]
            left = sum(len(word) for value in values for word in WORD.findall(value))
            own = len(WORD.findall(PLACE.sub(" ", key)))
            result = PLACE.sub(lambda place, values=values: values[int(place[1])], translation)  # type: ignore[misc]
            if best is None or (-left, own) > best[:2]:
                best = (-left, own, result)
        return best[2] if best else None

    def _candidates(self, core: str) -> Iterator[str]:
        for word in ["", *dict.fromkeys(WORD.findall(core))]:
            yield from self._by_word.get(word, ())


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


def _mark(mark: str) -> str:
    return {". ": "。", "; ": "；", ": ": "：", " (": "（", ", ": "，", " and ": "、", " or ": "或"}.get(mark, mark)
