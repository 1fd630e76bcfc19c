"""Pages for people: self-contained, printable HTML without scripts. The template engine escapes every text.

Pictures are SVG by matplotlib. Each is a separate image in the page, with all letters drawn as paths. It shows numbers,
words of this program, and names of families, which have only letters, digits, hyphens, underscores and dots.
"""

import base64
import contextlib
import functools
import io
import re
from collections.abc import Iterator
from typing import Any

import jinja2
import matplotlib
from markupsafe import Markup
from matplotlib import font_manager
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import FixedLocator

from pipeline.language.chosen import ENGLISH, language, translated
from pipeline.language.html_text import translated_page

# Colours after Okabe and Ito, distinct for colour-blind readers, also in grey print.
INK, QUIET, ALARM = "#1a1a1a", "#8a8f98", "#b00020"
LASER, COARSE, SONAR = "#3aa0dc", "#b9bcc1", "#d55e00"
FAMILY = {"P1": "#0072b2", "P2": "#e6a000", "P3": "#009e73", "H": "#b2569a", "other": "#7a5c00", "more": "#1a1a1a"}
AXIS = {"roll": "#0072b2", "pitch": "#e6a000", "yaw": "#009e73"}
MARKS = {"P1": "v", "P2": "o", "P3": "^", "H": "s", "other": "D", "more": "X"}
WIDTH_IN = 7.2  # width of every picture
SMALLEST_PT = 8  # size of the smallest letters in a picture
DPI = 200  # resolution of point clouds, which are drawn as pixels in the vector picture
FONTS = {  # with Chinese letters, by the names that they have on Linux and Windows
    "zh": (
        "Noto Sans CJK SC", "Noto Sans SC", "Source Han Sans SC", "WenQuanYi Micro Hei", "WenQuanYi Zen Hei",
        "Droid Sans Fallback", "Microsoft YaHei", "SimHei",
    ),
}  # fmt: skip
HEAD_LETTERS = 70  # length of the running head of a printed page
MARGIN_TEXT = "font: 8pt system-ui, 'Noto Sans', 'Noto Sans CJK SC', sans-serif; color: #50555d;"
STYLE: dict[Any, Any] = {
    "svg.fonttype": "path",
    "svg.hashsalt": "poolcal",
    "font.size": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": QUIET,
    "axes.linewidth": 0.8,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # the usual place; set, it saves a slow search for ticks in the way
    "xtick.color": INK,
    "ytick.color": INK,
}


@contextlib.contextmanager
def drawing_style() -> Iterator[None]:
    """Set the style of all pictures on top of matplotlib's defaults; the machine's own settings have no effect."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def render_page(template: str, **values: Any) -> str:
    """Return a page made from ``pipeline/results/pages/<template>`` with these values."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("pipeline.results", "pages"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["breakable"] = breakable
    environment.filters["translated"] = translated
    fixed = {"css": css_text, "picture_px": round(96 * WIDTH_IN), "margin_text": Markup(MARGIN_TEXT)}
    return translated_page(environment.get_template(template).render(**fixed, **values))


def css_text(text: str) -> Markup:
    r"""Return untrusted text, cut in length, for a quoted CSS string. Only ASCII letters, digits and spaces stay.

    >>> css_text('a "} </style>')
    Markup('a \\22 \\7d  \\3c \\2f style\\3e ')
    """
    short = text if len(text) <= HEAD_LETTERS else f"{text[:HEAD_LETTERS]}…"
    plain = (c if c == " " or (c.isascii() and c.isalnum()) else f"\\{ord(c):x} " for c in short)
    return Markup("".join(plain))


def breakable(text: str) -> Markup:
    """Return a name in which a browser may break the line after _ and -, but not within a word.

    >>> breakable("harbour_<b>")
    Markup('harbour_<wbr>&lt;b&gt;')
    """
    return Markup("<wbr>").join(Markup.escape(part) for part in re.split(r"(?<=[_-])", text))


def _translate(figure: Figure) -> None:
    """Translate the texts of a figure, if a font on this machine has the letters; else they stay English."""
    if language() == ENGLISH or not (fonts := fonts_of(language())):
        return
    for text in figure.findobj(Text):
        words = translated(text.get_text())
        if words != text.get_text():
            text.set_text(words)
            text.set_fontfamily([*fonts, *text.get_fontfamily()])
    for axis in (one for axes in figure.axes for one in (axes.xaxis, axes.yaxis)):
        if isinstance(axis.get_major_locator(), FixedLocator):  # drawing makes the texts at its ticks anew
            texts = axis.get_ticklabels()
            before = [text.get_text() for text in texts]
            if (after := [translated(words) for words in before]) != before:
                axis.set_ticklabels(after, fontfamily=[*fonts, *texts[0].get_fontfamily()])


@functools.cache
def fonts_of(code: str) -> list[str]:
    """Return the names of this machine's fonts with the letters of a language, the usual ones first."""
    found = _known_fonts(code)
    if not found:  # matplotlib keeps a list of fonts from its first call on; one may have been installed since
        known = {font.fname for font in font_manager.fontManager.ttflist}
        for path in sorted(set(font_manager.findSystemFonts()) - known):
            with contextlib.suppress(OSError, RuntimeError):  # a file that is no font, or of a kind that it cannot read
                font_manager.fontManager.addfont(path)
        found = _known_fonts(code)
    return found


def _known_fonts(code: str) -> list[str]:
    there = {font.name for font in font_manager.fontManager.ttflist}
    return [name for name in FONTS.get(code, ()) if name in there]


def picture(figure: Figure, label: str) -> Markup:
    """Return the figure as an HTML image; ``label``: its description for readers who cannot see it."""
    _translate(figure)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", dpi=DPI, metadata={"Date": None, "Creator": None})
    data = base64.b64encode(buffer.getvalue()).decode("ascii")
    return Markup('<img class="picture" alt="{}" src="data:image/svg+xml;base64,{}">').format(label, data)
