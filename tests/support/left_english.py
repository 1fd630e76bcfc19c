"""English that a reader of another language would meet: in a page, in its pictures, on the screen.

What may stay English is listed here, with the reason.
"""

import re
from collections.abc import Iterable, Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

UNREAD = ("style", "script", "code", "pre", "title")
SPOKEN = ("alt", "title", "aria-label")
VOID = ("area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "source", "track", "wbr")
SAME = {  # words that are the same in every language
    "units": "deg m mm cm km s ms min h Hz dB kn ppm UTC GPS TAI",
    "axes, symbols and formulas": "x y z a b c e w t H P1 P2 P3 R_z cos sin exp",
    "names of the field": (
        "INS IMU GNSS RTK PPK MBES LiDAR RANSAC WGS84 WGS ITRF CGCS2000 EGM2008 "
        "TVU THU DVL TPU IHO S-44 NED ENU Helmert RMS"
    ),
    "stages, by the names of their folders and commands": "ingest georeference segment adjust offsets report",
    "words that surveyors use as they are": "ping",
    "values in the files": "null true false",
    "products and standards": (
        "poolcal Qinsy Qimera QPS CARIS HIPS HYPACK SIS Kongsberg R2Sonic SBET RIEGL LAS LAZ XTF PCAP Rerun "
        "Chromium GB "
        "Parquet JSON YAML CSV PDF SVG Python SHA SHA-256 dask PosMv POSPac NovAtel"
    ),
}
WORDS = {word for group in SAME.values() for word in group.split()}
PHRASES = (  # formulas, names of orders and of a procedure that stand in brackets behind the Chinese, a patent, a key
    "R = Rz(yaw) · Rx(pitch) · Ry(roll)", "Exp(correction) · coarse", "Special Order", "Exclusive Order", "patch test",
    "CN 105425246 B", "calibration.json：held",
)  # fmt: skip
KEYS = re.compile(  # keys, file names, commands: written as the files and the shell have them
    r"S-44|SHA-256|sha256sum|INS_[A-Z]+|[\w-]*(?:[._/][\w*<>-]+)+[._/]?|[a-z]+_[a-z_]+|--[a-z][a-z-]*|[0-9a-f]{8,}"
    r"|https?://\S+|RUN|SESSION|NAME|SOUNDINGS|poolcal [a-z-]+"
)
ENGLISH = re.compile(r"(?<![\w.-])[A-Za-z][A-Za-z'’-]+")


class _Texts(HTMLParser):
    """The visible texts of a page, each with what stands between two tags; none of an element marked as data."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.found: list[str] = []
        self._left: list[str] = []
        self._text = ""
        self.feed(html)
        self.close()
        self._end()

    def _end(self) -> None:
        if self._text.strip():
            self.found.append(" ".join(self._text.split()))
        self._text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "wbr":
            return
        self._end()
        self.found += [value for name, value in attrs if name in SPOKEN and value]
        if tag not in VOID and (self._left or tag in UNREAD or ("translate", "no") in attrs):
            self._left.append(tag)

    def handle_endtag(self, tag: str) -> None:
        self._end()
        if self._left and self._left[-1] == tag:
            self._left.pop()

    def handle_data(self, data: str) -> None:
        if not self._left:
            self._text += data


def texts_of_page(path: Path) -> list[str]:
    """Return the visible texts of a page, and those that are read out."""
    return _Texts(path.read_text(encoding="utf-8")).found


def watch_pictures(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return a list that takes up the texts of every figure that is saved from now on."""
    found: list[str] = []
    save = Figure.savefig

    def watched(figure: Figure, *words: Any, **values: Any) -> None:
        save(figure, *words, **values)  # drawing makes the texts at the ticks anew
        found.extend(text.get_text() for text in figure.findobj(Text))

    monkeypatch.setattr(Figure, "savefig", watched)
    return found


def english_of(texts: Iterable[str], data: Iterable[str] = ()) -> Iterator[tuple[str, str]]:
    """Yield each text that has English words, with these words.

    Parameters
    ----------
    texts
        What a reader meets.
    data
        Names that the session gives, such as that of the run folder.
    """
    names = sorted({*data, *PHRASES}, key=len, reverse=True)
    for text in dict.fromkeys(texts):
        rest = text
        for name in names:
            rest = rest.replace(name, " ")
        words = [word for word in ENGLISH.findall(KEYS.sub(" ", rest)) if word not in WORDS]
        if words:
            yield text, " ".join(words)


def assert_chinese(texts: Iterable[str], *data: object) -> None:
    """Assert that no text has English words, beside names that the session gives."""
    left = list(english_of(texts, map(str, data)))
    assert not left, "\n".join(f"[{words}] {text}" for text, words in left)
