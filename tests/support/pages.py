"""A page taken apart: its texts, its tables, its tags."""

from html.parser import HTMLParser


class Page(HTMLParser):
    """Tables as rows of cells; headings; every tag with its attributes; all text."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.tables: list[list[list[str]]] = []
        self.headings: list[str] = []
        self.text = ""
        self._open: list[str] = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in ("meta", "img", "br", "wbr"):
            self._open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")
        elif tag in ("h1", "h2"):
            self.headings.append("")

    def handle_endtag(self, tag: str) -> None:
        while self._open and self._open.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        if "style" in self._open:
            return
        self.text += data
        if "td" in self._open or "th" in self._open:
            self.tables[-1][-1][-1] += data
        elif self._open and self._open[-1] in ("h1", "h2"):
            self.headings[-1] += data

    def named(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]

    def table(self, *heads: str) -> list[list[str]]:
        """The rows of the one table whose head begins with these words."""
        (found,) = [rows for rows in self.tables if tuple(cell.strip() for cell in rows[0])[: len(heads)] == heads]
        return [[" ".join(cell.split()) for cell in row] for row in found[1:]]


def assert_self_contained(page: Page) -> None:
    """Nothing to run and nothing to fetch: the page is complete in itself."""
    assert not page.named("script")
    assert not page.named("link")
    assert not page.named("iframe")
    for tag, attributes in page.tags:
        assert not [name for name in attributes if name.startswith("on")], tag
        for name in ("src", "href"):
            value = attributes.get(name)
            assert value is None or value.startswith("data:image/svg+xml;base64,"), value
