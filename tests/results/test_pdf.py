"""Which program writes the PDF; what is said where none can, and where one fails."""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pipeline.errors import ArtefactError
from pipeline.results.pages import pdf
from pipeline.results.pages.pdf import write_pdf

PRINTS = "#!/bin/sh\nfor word; do case $word in --print-to-pdf=*) made=${word#*=};; esac; done\n"


@pytest.fixture
def page(tmp_path: Path) -> Path:
    path = tmp_path / "水池 page.html"
    path.write_text("<p>池</p>", encoding="utf-8")
    return path


@pytest.fixture
def bare(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine with neither the library nor a browser: the folder that its PATH names, with sh in it."""
    programs = tmp_path / "bin"
    programs.mkdir()
    monkeypatch.setenv("PATH", f"{programs}")
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    return programs


def browser(folder: Path, script: str) -> None:
    (folder / "chromium").write_text(PRINTS + script)
    (folder / "chromium").chmod(0o755)


def refusal(page: Path, file: Path) -> str:
    with pytest.raises(ArtefactError) as error:
        write_pdf(page, file)
    (line,) = str(error.value).splitlines()
    assert not file.exists()
    return line


def test_neither_is_here(page: Path, bare: Path, tmp_path: Path) -> None:
    line = refusal(page, tmp_path / "out.pdf")
    assert "pip install 'poolcal[pdf]'" in line
    assert "Chromium" in line
    assert str(page) in line


def test_a_browser_prints(page: Path, bare: Path, tmp_path: Path) -> None:
    """It is given a home of its own and no way to the network, and its time of day is taken out."""
    made = "/CreationDate (D:20261125140400)"
    told = 'for last; do :; done\necho "%PDF-1.4 $* $HOME" > $made\n/bin/cat "${last#file://}" >> $made\n'
    browser(bare, f'{told}echo "{made}" >> $made\n')
    assert write_pdf(page, tmp_path / "out.pdf") == "chromium"
    written = (tmp_path / "out.pdf").read_text(encoding="utf-8")
    assert page.read_text(encoding="utf-8") in written
    assert "MAP * ~NOTFOUND" in written
    assert str(Path.home()) not in written.replace(str(tmp_path), "")
    assert "/CreationDate (D:19800106000000)" in written


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("exit 3\n", "wrote no PDF"),
        ("echo '%PDF' > $made\nexit 3\n", "wrote no PDF (status 3)"),
        ("echo '<html>' > $made\n", "wrote no PDF (status 0)"),
        ("exec /bin/sleep 60\n", "wrote no PDF within 1 s"),
    ],
)
def test_a_browser_that_fails(
    page: Path, bare: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, words: str
) -> None:
    monkeypatch.setattr(pdf, "TIMEOUT_S", 1.0)
    browser(bare, script)
    line = refusal(page, tmp_path / "out.pdf")
    assert words in line
    assert f"print {page} by hand" in line


class Html:
    """Stands for weasyprint.HTML: its PDF tells what it was given."""

    def __init__(self, string: str, url_fetcher: Any) -> None:
        self.content = f"%PDF {string} {url_fetcher['allowed_protocols']}"

    def write_pdf(self) -> bytes:
        return self.content.encode()


def test_the_library_goes_first_and_fetches_nothing(
    page: Path, bare: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    browser(bare, "exit 3\n")
    urls = SimpleNamespace(URLFetcher=dict)
    monkeypatch.setitem(sys.modules, "weasyprint", SimpleNamespace(HTML=Html, urls=urls, __version__="70.0"))
    assert write_pdf(page, tmp_path / "out.pdf") == "WeasyPrint 70.0"
    assert (tmp_path / "out.pdf").read_text(encoding="utf-8") == "%PDF <p>池</p> ('data',)"
    old = SimpleNamespace(HTML=Html, urls=SimpleNamespace(), __version__="52.5")  # too old to be kept from the network
    monkeypatch.setitem(sys.modules, "weasyprint", old)
    assert "wrote no PDF" in refusal(page, tmp_path / "other.pdf")
