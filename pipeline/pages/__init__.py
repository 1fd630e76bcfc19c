"""Pages for people: self-contained HTML, no script, printable. Every text is escaped by the template engine.

Pictures are SVG made by matplotlib and put into the page as they are; they carry numbers and our own words alone, never
a name from a file or a config.
"""

import io
from typing import Any

import jinja2
from markupsafe import Markup
from matplotlib.figure import Figure

INK, QUIET, LASER, SONAR, ALARM = "#1a1a1a", "#8a8f98", "#0072b2", "#d55e00", "#b00020"  # Okabe and Ito: for all eyes
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
    "xtick.color": INK,
    "ytick.color": INK,
}


def render(template: str, **values: Any) -> str:
    """A page from ``pipeline/pages/<template>``."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("pipeline", "pages"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(**values)


def svg(figure: Figure, label: str) -> Markup:
    """The figure as an element of the page, with words for those who cannot see it."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    picture = text[text.index("<svg") :].replace("<svg", f'<svg role="img" aria-label="{Markup.escape(label)}"', 1)
    return Markup(picture)
