"""The catalogues: every text of the program is in them, translated, with the same values."""

import re
from pathlib import Path

import pytest
from babel.messages.pofile import read_po

from pipeline.language.chosen import FOLDER, languages
from tools.messages import program_texts

OTHERS = [code for code in languages() if code != "en"]
CHINESE = re.compile("[\u4e00-\u9fff]")


def entries(code: str) -> dict[str, str]:
    with Path(FOLDER, code, "poolcal.po").open("rb") as file:
        return {str(entry.id): str(entry.string) for entry in read_po(file) if entry.id}


@pytest.mark.parametrize("code", OTHERS)
def test_every_text_of_the_program_is_there_and_no_other(code: str) -> None:
    assert set(entries(code)) == set(program_texts()), "run python -m tools.messages, and translate what is new"


@pytest.mark.parametrize("code", OTHERS)
def test_every_text_is_translated(code: str) -> None:
    assert [text for text, translation in entries(code).items() if not translation] == []


@pytest.mark.parametrize("code", OTHERS)
def test_values_agree(code: str) -> None:
    wrong = [
        text
        for text, translation in entries(code).items()
        if sorted(re.findall(r"\{(\d+)\}", text)) != sorted(re.findall(r"\{(\d+)[!#]?\}", translation))
    ]
    assert wrong == []


def test_most_chinese_texts_are_chinese() -> None:
    """What is left as it is has names, code and units alone."""
    found = entries("zh")
    same = [text for text, translation in found.items() if not CHINESE.search(translation)]
    assert len(same) < 0.08 * len(found), same
