"""A page is drawn anew if anything that makes it has changed: words of any package, a template, the catalogue."""

import shutil
from pathlib import Path

import pytest

import pipeline
from pipeline.results.pages.currency import drawing_digests


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the program."""
    folder = tmp_path_factory.mktemp("program")
    here = Path(pipeline.__file__).parent
    shutil.copytree(here, folder / "pipeline", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def changed(root: Path, file: str, code: str) -> bool:
    """Whether the page in a language is another one after an addition to a file."""
    path = root / "pipeline" / file
    before = drawing_digests(root, code)
    with path.open("ab") as end:
        end.write(b"\n# a later version\n")
    drawing_digests.cache_clear()
    return drawing_digests(root, code) != before


@pytest.mark.parametrize(
    "file",
    [
        "results/pages/report.html",
        "results/pages/face_maps.py",
        "maths/target/family_words.py",
        "maths/survey/sounding_uncertainty.py",
        "report/cause_words.py",
        "run/origins.py",
        "language/html_text.py",
    ],
)
def test_what_makes_the_page_counts(root: Path, file: str) -> None:
    assert changed(root, file, "en")


def test_the_catalogue_counts_in_its_language(root: Path) -> None:
    assert changed(root, "language/zh/poolcal.po", "zh")
    assert not changed(root, "language/zh/poolcal.po", "en")


def test_what_the_page_does_not_use_does_not_count(root: Path) -> None:
    assert not changed(root, "exports/registry.py", "en")
