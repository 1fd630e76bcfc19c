"""The documents: links arrive, commands and settings in them are the program's, and README stays short."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer.main

from pipeline.report.reason_codes import ReasonCode
from pipeline.report.remedies import REMEDIES
from stages.cli import call
from stages.cli.application import app
from tests.support.roots import ROOT
from tools.reference_pages import PAGES

DOCS = ROOT / "docs"
PAGES_AND_README = [ROOT / "README.md", ROOT / "CONVENTIONS.md", *sorted(DOCS.rglob("*.md"))]
LINK = re.compile(r"\]\((?!https?:|mailto:)([^)\s#]*)(?:#([^)\s]+))?\)")
FENCE = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"^(?: {4}|\$ |\.venv/bin/)(?:\.venv/bin/)?poolcal ([a-z].*)$", re.MULTILINE)
INLINE = re.compile(r"`poolcal ([a-z][^`]*)`")
MOST_LINES_OF_README = 150


def _anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as the site makes them."""
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    titles = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", title).strip().lower()) for title in titles}


@pytest.mark.parametrize("page", PAGES_AND_README, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_arrive(page: Path) -> None:
    for target, anchor in LINK.findall(page.read_text(encoding="utf-8")):
        file = (page.parent / target).resolve() if target else page
        assert file.is_file(), (page, target)
        assert file.is_relative_to(ROOT), (page, target)
        if anchor and file.suffix == ".md":
            assert anchor in _anchors(file), (page, target, anchor)


def test_every_page_is_in_the_site_once() -> None:
    nav = re.findall(r"- (?:[\w ]+: )?([\w/-]+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(nav) == sorted(page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md"))


def _commands_of_the_program() -> Any:
    """Return the program's commands by name; typer's types do not say that its group has them."""
    group: Any = typer.main.get_command(app)
    return group.commands


def _commands(page: Path) -> Iterator[str]:
    text = page.read_text(encoding="utf-8")
    yield from COMMAND.findall(text)
    yield from INLINE.findall(text)


@pytest.mark.parametrize("page", PAGES_AND_README, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_commands_are_the_programs(page: Path) -> None:
    """Each command that a page shows exists, and has the options that the page gives it."""
    known = _commands_of_the_program()
    for line in _commands(page):
        words = shlex.split(re.split(r"\s{3,}|\s#", line)[0].replace("…", "").replace("'", ""))
        name = words[0]
        assert name in known, (page, line)
        parameters = known[name].params
        options = {option for one in parameters for option in (*one.opts, *one.secondary_opts)}
        given = {word.partition("=")[0] for word in words[1:] if word.startswith("--")}
        assert given - options - {"--help", "--debug"} == set(), (page, line)


@pytest.mark.parametrize("name", PAGES)
def test_pages_made_from_the_program_are_up_to_date(name: str) -> None:
    assert (DOCS / name).read_text(encoding="utf-8") == PAGES[name](), "run python -m tools.reference_pages"


def test_every_reason_has_its_remedy() -> None:
    assert list(REMEDIES) == list(ReasonCode)
    for remedy in REMEDIES.values():
        assert remedy.cause.endswith(".")
        assert remedy.remedy.endswith(".")


def test_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= MOST_LINES_OF_README


def test_the_first_words_say_what_it_has_been_proven_on() -> None:
    for page in (ROOT / "README.md", DOCS / "index.md"):
        begin = " ".join(page.read_text(encoding="utf-8").split()[:250])
        assert "simulat" in begin, page


def test_help_of_every_command_ends_well(capsys: pytest.CaptureFixture[str]) -> None:
    for name in _commands_of_the_program():
        assert call([name, "--help"]) == 0
        assert f"poolcal {name}" in capsys.readouterr().out
