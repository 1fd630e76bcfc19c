"""Bring the catalogues of other languages up to date with the program's texts.

Texts are found in the sources themselves: every string of more than one word, f-strings with places for their values,
and the single words that stand in for a value; in the pages' templates every text between two tags. Entries whose text
is gone are left out; new ones are empty, and a test asks for their translation.

    python -m tools.messages            # writes pipeline/language/<language>/poolcal.po
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from babel.messages.catalog import Catalog
from babel.messages.pofile import read_po, write_po

ROOT = Path(__file__).parents[1]
LANGUAGE = ROOT / "pipeline" / "language"
PLACES = (  # where text for people is made
    "pipeline/console.py", "pipeline/adjustment", "pipeline/checking", "pipeline/coarse", "pipeline/entry_check",
    "pipeline/exports", "pipeline/fleet", "pipeline/maths/mount_parameters.py", "pipeline/planning", "pipeline/report",
    "pipeline/results", "pipeline/run", "pipeline/starting", "pipeline/target", "pipeline/config", "pipeline/readers",
    "pipeline/errors.py", "pipeline/georeference", "pipeline/artefacts/count_codes.py", "stages/commands",
)  # fmt: skip
PROSE = re.compile(r"[A-Za-z]{2,}[^A-Za-z_/.=]+[A-Za-z]{2,}|[A-Za-z]{2,} \{\d|\{\d+\} [A-Za-z]{2,}")
IDENTIFIER = re.compile(r"[a-z0-9_.*/{}\[\]:-]*[_/\[=][a-z0-9_.*/{}\[\]:-]*")


def texts_of(path: Path) -> Iterator[tuple[str, int]]:
    """Yield the texts for people in a source, each with its line."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    inside: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            inside |= {id(part) for part in node.values}
            inside |= {id(p) for v in node.values if isinstance(v, ast.FormattedValue) and v.format_spec for p in ast.walk(v.format_spec)}
    for node in ast.walk(tree):
        if id(node) in docstrings or id(node) in inside:
            continue
        if isinstance(node, ast.JoinedStr):
            text = template_of(node)
            if PROSE.search(text):
                yield text, node.lineno
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value
            if PROSE.search(text) and not IDENTIFIER.fullmatch(text):
                yield text, node.lineno


def template_of(node: ast.JoinedStr) -> str:
    """Return an f-string as a sentence with numbered places for its values."""
    parts, number = [], 0
    for part in node.values:
        if isinstance(part, ast.Constant):
            parts.append(str(part.value))
        else:
            parts.append(f"{{{number}}}")
            number += 1
    return "".join(parts)
