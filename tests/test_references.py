"""What documents and docstrings name exists: a reader who follows a name must arrive."""

import re
from pathlib import Path

import pytest

from tests.support.roots import ROOT
from tools.patent_forms import CASES, MARKS

DOCUMENTS = ["README.md", "CONVENTIONS.md", "Makefile", "pyproject.toml", "configs/defaults.yaml", "docs/patent.md"]
FILE = re.compile(r"(?<![\w./-])((?:[\w-]+/)*[\w-]+\.py)\b")
ROLE = re.compile(r":(mod|class|func|meth|data):`~?(?P<name>(?:pipeline|stages|tests|tools)[\w.]*)`")
SOURCES = sorted(path for folder in ("pipeline", "stages", "tools", "tests") for path in (ROOT / folder).rglob("*.py"))
PATHS = [path.relative_to(ROOT).as_posix() for path in SOURCES]


@pytest.mark.parametrize("document", DOCUMENTS)
def test_files_that_a_document_names_exist(document: str) -> None:
    """A path may be shortened from the left: README's tables leave out ``pipeline/``."""
    named = set(FILE.findall((ROOT / document).read_text(encoding="utf-8")))
    assert {name for name in named if not any(f"/{path}".endswith(f"/{name}") for path in PATHS)} == set()


def test_names_that_a_docstring_refers_to_exist() -> None:
    missing = []
    for path in SOURCES:
        for role in ROLE.finditer(path.read_text(encoding="utf-8")):
            module, _, name = role["name"].rpartition(".") if role[1] != "mod" else (role["name"], "", "")
            if role[1] == "meth":
                module, _, name = module.rpartition(".")
            file = Path(ROOT, *module.split("."))
            file = file / "__init__.py" if file.is_dir() else file.with_suffix(".py")
            if not file.is_file() or not re.search(rf"\b{name}\b", file.read_text(encoding="utf-8")):
                missing.append((path.relative_to(ROOT).as_posix(), role[0]))
    assert missing == []


def test_the_patents_page_has_every_case_of_its_tool_and_readme_links_to_it() -> None:
    page = (ROOT / "docs" / "patent.md").read_text(encoding="utf-8")
    table = page.split(MARKS[0])[1].split(MARKS[1])[0]
    assert re.findall(r"^\| \*\*(.*)\*\* \|", table, re.MULTILINE) == [case.words for case in CASES]
    assert table.count("| patent_literal |") == len(CASES)
    assert "](docs/patent.md)" in (ROOT / "README.md").read_text(encoding="utf-8")
