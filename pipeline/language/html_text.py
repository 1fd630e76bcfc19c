"""The texts of an HTML page in the language of this process: what stands between tags, and what pictures show.

Elements with ``translate="no"``, code, styles and pictures are left as they are. The page is taken apart by the parser
of the standard library, and put together again with all other characters unchanged.
"""

import re
from html import escape, unescape
from html.parser import HTMLParser

from pipeline.language.chosen import ENGLISH, language, translated

LEFT = ("style", "script", "code", "pre", "svg", "title")  # elements whose texts are not translated
SPOKEN = ("alt", "title", "aria-label")  # attributes that are read out or shown
MARKS = str.maketrans({".": "。", ";": "；", ",": "，", ":": "：", "(": "（", ")": "）", " ": ""})  # between elements
VOID = ("area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "source", "track", "wbr")


def translated_page(page: str) -> str:
    """Return a page with its texts translated; the same page if this process speaks English."""
    if language() == ENGLISH:
        return page
    reader = _Page()
    reader.feed(page)
    reader.close()
    reader.end_text()
    return "".join(reader.parts).replace('<html lang="en">', f'<html lang="{language()}">', 1)


def _translated(text: str) -> str:
    """Return the text between two tags in the language of this process: words, or marks alone.

    A browser shows every run of blanks and ends of lines as one blank.
    """
    line = re.sub(r"[ \t\r\n]+", " ", unescape(text))
    return line.translate(MARKS) if re.fullmatch(r" ?[.;,:()][.;,:() ]*", line) else translated(line)


class _Page(HTMLParser):
    """Parts of a page as they come, texts translated. A text goes on over ``<wbr>``."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=False)
        self.parts: list[str] = []
        self.text = ""
        self.left: list[str] = []  # open elements below one that is left as it is, itself the first

    def end_text(self) -> None:
        """Write the text that has been read."""
        if self.text:
            self.parts.append(self.text if self.left else escape(_translated(self.text), quote=False))
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Write a tag, its spoken attributes translated."""
        raw = self.get_starttag_text() or ""
        if tag == "wbr" and not self.left:
            return
        self.end_text()
        for name, value in attrs:
            found = re.search(rf'\b{name}="[^"]*"', raw) if name in SPOKEN and value else None
            if found and value:
                raw = f'{raw[: found.start()]}{name}="{escape(translated(value))}"{raw[found.end() :]}'
        self.parts.append(raw)
        if tag not in VOID and (self.left or tag in LEFT or ("translate", "no") in attrs):
            self.left.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Write a tag that closes itself."""
        self.end_text()
        self.parts.append(self.get_starttag_text() or "")

    def handle_endtag(self, tag: str) -> None:
        """Write a closing tag."""
        self.end_text()
        self.parts.append(f"</{tag}>")
        if self.left and self.left[-1] == tag:
            self.left.pop()

    def handle_data(self, data: str) -> None:
        """Keep a part of a text."""
        self.text += data

    def handle_entityref(self, name: str) -> None:
        """Keep a character that is written by its name."""
        self.text += f"&{name};"

    def handle_charref(self, name: str) -> None:
        """Keep a character that is written by its number."""
        self.text += f"&#{name};"

    def handle_comment(self, data: str) -> None:
        """Write a comment."""
        self.end_text()
        self.parts.append(f"<!--{data}-->")

    def handle_decl(self, decl: str) -> None:
        """Write the declaration of the document's type."""
        self.end_text()
        self.parts.append(f"<!{decl}>")
