"""Bring the catalogues of other languages up to date with the program's texts.

Texts are found in the sources themselves: strings of more than one word, f-strings with places for their values, and
words that stand in for a value of an f-string; in the pages' templates every text between two tags, with each of its
conditions met and not met. Entries whose text is gone are left out; new ones are empty, until somebody translates them.

    python -m tools.messages            # writes pipeline/language/<language>/poolcal.po
"""

import ast
import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from babel.messages.catalog import Catalog
from babel.messages.pofile import read_po, write_po

ROOT = Path(__file__).parents[1]
LANGUAGE = ROOT / "pipeline" / "language"
TEMPLATES = ROOT / "pipeline" / "results" / "pages"
PLACES = (  # where texts for people are made
    "pipeline/adjustment", "pipeline/artefacts/count_codes.py", "pipeline/artefacts/parquet.py",
    "pipeline/artefacts/patent_tables.py", "pipeline/artefacts/streams.py", "pipeline/artefacts/water_levels.py",
    "pipeline/atomic_files.py",
    "pipeline/checking", "pipeline/coarse", "pipeline/config", "pipeline/console.py", "pipeline/entry_check",
    "pipeline/exports", "pipeline/finding/bottom.py", "pipeline/finding/dry_planes.py",
    "pipeline/finding/found_text.py", "pipeline/finding/kept_points.py", "pipeline/finding/place.py", "pipeline/fleet",
    "pipeline/georeference", "pipeline/language/chosen.py", "pipeline/maths",
    "pipeline/limits", "pipeline/patch_test", "pipeline/planning", "pipeline/readers", "pipeline/report",
    "pipeline/results", "pipeline/run", "pipeline/simulation", "pipeline/starting", "pipeline/target", "stages",
)  # fmt: skip
PROSE = re.compile(r"[A-Za-z]{2,}[,;:.]? +\(?[A-Za-z{]|\} [A-Za-z]{2,}")
CODE = re.compile(r"[\w.*/{}\[\]:=-]*|(?:application|text)/.*|.*%[sd].*|<.*>|.*\.parquet.*|\^.*|.*\\\w.*", re.DOTALL)
MOST_CONDITIONS = 4  # of one text of a template
WORDS = ROOT / "tools" / "message_words.txt"  # single words that tables and charts show, one a line


def program_texts() -> dict[str, str]:
    """Return all texts for people, each with the place of its first source."""
    found: dict[str, str] = {}
    for place in PLACES:
        path = ROOT / place
        for file in [path] if path.suffix else sorted(path.rglob("*.py")):
            for text, line in texts_of(file):
                found.setdefault(text, f"{file.relative_to(ROOT).as_posix()}:{line}")
    for file in sorted(TEMPLATES.glob("*.html")):
        for text in template_texts(file.read_text(encoding="utf-8")):
            found.setdefault(text, file.relative_to(ROOT).as_posix())
    for text in WORDS.read_text(encoding="utf-8").splitlines():
        found.setdefault(text, WORDS.relative_to(ROOT).as_posix())
    return {" ".join(text.split()): place for text, place in found.items() if text.strip()}


def texts_of(path: Path) -> Iterator[tuple[str, int]]:
    """Yield the texts for people in a source, each with its line."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    skipped = {id(node) for node in _docstrings(tree)}
    values: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            skipped |= {id(part) for part in node.values}
            for part in node.values:
                if isinstance(part, ast.FormattedValue):
                    values |= {id(one) for one in ast.walk(part.value)}
                    skipped |= {id(one) for one in ast.walk(part.format_spec)} if part.format_spec else set()
        elif isinstance(node, (ast.Subscript, ast.Compare)):
            skipped |= {id(one) for one in ast.walk(node) if not _is_annotated(node)}
        elif isinstance(node, ast.keyword) and node.arg == "metavar":  # typed as it stands
            skipped |= {id(one) for one in ast.walk(node)}
        elif isinstance(node, ast.FunctionDef) and _is_command(node):
            for paragraph in (ast.get_docstring(node) or "").split("\n\n"):
                yield paragraph, node.lineno
    for node in ast.walk(tree):
        if id(node) in skipped:
            continue
        if isinstance(node, ast.JoinedStr) and _is_text(text := template_of(node)):
            yield text, node.lineno
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = numbered(node.value)
            if _is_text(text) or (id(node) in values and re.fullmatch(r"[a-z ]{3,}", text)):
                yield text, node.lineno


def _docstrings(tree: ast.AST) -> Iterator[ast.expr]:
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
            for one in node.body:
                if isinstance(one, ast.Expr):
                    yield one.value


def _is_annotated(node: ast.Subscript | ast.Compare) -> bool:
    return isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id == "Annotated"


def _is_command(node: ast.FunctionDef) -> bool:
    """Return whether the docstring of a function is the help of a command."""
    calls = (one.func for one in node.decorator_list if isinstance(one, ast.Call))
    return any(isinstance(called, ast.Attribute) and called.attr == "command" for called in calls)


def _is_text(text: str) -> bool:
    return bool(PROSE.search(text)) and not CODE.fullmatch(text)


def template_of(node: ast.JoinedStr) -> str:
    """Return an f-string as a sentence with numbered places for its values."""
    numbers = itertools.count()
    return "".join(
        str(part.value) if isinstance(part, ast.Constant) else f"{{{next(numbers)}}}" for part in node.values
    )


def numbered(text: str, places: str = r"\{[a-z_]*(?::[^{}]*)?\}") -> str:
    """Return a text with its places numbered: those of ``str.format``, or those that an expression matches.

    >>> numbered("{} of {name} is {:+.2f}")
    '{0} of {1} is {2}'
    """
    numbers = itertools.count()
    return re.sub(places, lambda _: f"{{{next(numbers)}}}", text)


def template_texts(source: str) -> Iterator[str]:
    """Yield the texts between the tags of a template, with each combination of the conditions in them."""
    source = re.sub(r"<style.*?</style>|\{#.*?#\}", "", source, flags=re.DOTALL)
    source = re.sub(r"\{%-?\s*(?!\s|if|elif|else|endif)[^%]*%\}", "<>", source)
    for piece in re.split(r"<(?!wbr)[^>]*>", source):
        for text in _alternatives(piece.strip()):
            text = " ".join(numbered(text, r"\{\{.*?\}\}").split())
            if re.search(r"[A-Za-z]{2,}", re.sub(r"\{\d+\}", "", text)):
                yield text


def _alternatives(piece: str) -> Iterator[str]:
    """Yield a piece of a template with each combination of its conditions."""
    if piece.count("{% if") > MOST_CONDITIONS or piece.count("{% if") != piece.count("{% endif"):
        yield from re.split(r"\{%.*?%\}", piece)
        return
    found = re.search(r"\{% if [^%]*%\}((?:(?!\{% if|\{% endif).)*)\{% endif %\}", piece, re.DOTALL)
    if found is None:
        yield from re.split(r"\{%.*?%\}", piece)  # the whole piece, unless its conditions end in another one
        return
    branches = re.split(r"\{% el(?:se|if)[^%]*%\}", found[1])
    for branch in dict.fromkeys([*branches, *([""] if "{% else" not in found[0] else [])]):
        yield from _alternatives(piece[: found.start()] + branch + piece[found.end() :])


def updated(language: str) -> Catalog:
    """Return the catalogue of a language with the program's texts of today."""
    path = LANGUAGE / language / "poolcal.po"
    known = {}
    if path.is_file():
        with path.open("rb") as file:
            known = {str(entry.id): str(entry.string) for entry in read_po(file) if entry.id}
    catalogue = Catalog(locale=language, project="poolcal", fuzzy=False, creation_date=None, revision_date=None)
    for text, place in sorted(program_texts().items(), key=lambda item: (item[1].partition(":")[0], item[0])):
        source: Any = (place.partition(":")[0], None)
        catalogue.add(text, known.get(text, ""), locations=[source])
    return catalogue


def main() -> None:
    """Write the catalogue of each language."""
    for folder in sorted(path for path in LANGUAGE.iterdir() if path.is_dir() and not path.name.startswith("_")):
        catalogue = updated(folder.name)
        with (folder / "poolcal.po").open("wb") as file:
            write_po(file, catalogue, width=0, omit_header=True)
        print(f"{folder.name}: {len(catalogue)} texts, {sum(not one.string for one in catalogue if one.id)} open")


if __name__ == "__main__":
    main()
