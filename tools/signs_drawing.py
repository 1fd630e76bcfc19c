"""Draw the boat's axes and signs, as the certificate has them, into one picture.

Usage: python -m tools.signs_drawing docs/pictures/signs.svg
"""

import re
import sys
from pathlib import Path

from pipeline.config.mount import Mount
from pipeline.mount import mount_of
from pipeline.results.pages.rendering import INK, QUIET
from pipeline.results.pages.sign_drawing import sign_drawings

EXAMPLE = Mount(roll_deg=-48.8, pitch_deg=1.2, yaw_deg=-2.0, x_m=0.30, y_m=0.20, z_m=-2.01)  # the demo's sonar
WIDTH, HEIGHT = 230, 275


def picture(path: Path) -> None:
    """Draw the three views side by side, each with its words below."""
    views = sign_drawings(mount_of(EXAMPLE), sonar=True)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH * len(views)} {HEIGHT}" '
        f'font-family="DejaVu Sans, Arial, sans-serif" font-size="11" fill="{INK}">',
        f'<rect width="{WIDTH * len(views)}" height="{HEIGHT}" fill="#ffffff"/>',
    ]
    for k, view in enumerate(views):
        middle = WIDTH * (k + 0.5)
        shapes = re.sub(r"</?svg[^>]*>", "", str(view["svg"]))
        parts.append(f'<g transform="translate({middle} 120)">{shapes}</g>')
        for line, words in enumerate((view["name"], view["angle"], *str(view["axes"]).split(", "))):
            colour = QUIET if line == 0 else INK
            at = 14 if line == 0 else 222 + 15 * line
            parts.append(f'<text x="{middle}" y="{at}" text-anchor="middle" fill="{colour}">{words}</text>')
    path.write_text("".join(parts) + "</svg>\n", encoding="utf-8")


if __name__ == "__main__":
    picture(Path(sys.argv[1]))
