"""Sentences are found by their words, values are put in, and what is not known stays as it is."""

import pytest

from pipeline.language.matching import Catalogue

ENTRIES = {
    "roll": "横摇",
    "soundings": "水深点",
    "{0} scatter {1} times as much as {2}": "{2}的 {1} 倍：{0}的离散",
    "{0} scatter": "{0}离散",
    "the clock is {0} late": "时钟晚 {0}",
    "accepted": "合格",
    "no {0}": "没有{0}",
}


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    return Catalogue(ENTRIES)


@pytest.mark.parametrize(
    ("english", "chinese"),
    [
        ("roll", "横摇"),
        ("Roll", "横摇"),
        ("  roll ", "  横摇 "),
        ("soundings scatter 2.1 times as much as roll", "横摇的 2.1 倍：水深点的离散"),
        ("The clock is 5 ms late", "时钟晚 5 ms"),
        ("the clock is 5 ms late.", "时钟晚 5 ms。"),
        ("accepted; the clock is 5 ms late", "合格；时钟晚 5 ms"),
        ("accepted, roll.", "合格，横摇。"),
        ("accepted, 1.5.", "合格，1.5."),
        ("no soundings, no roll", "没有水深点，没有横摇"),
        ("1. the clock is 5 ms late", "1. 时钟晚 5 ms"),
        ("12. accepted: the clock is 5 ms late", "12. 合格：时钟晚 5 ms"),
        ("a file/名.xtf", "a file/名.xtf"),
        ("-48.8 °", "-48.8 °"),
        ("", ""),
    ],
)
def test_a_text_becomes(catalogue: Catalogue, english: str, chinese: str) -> None:
    assert catalogue.translated(english) == chinese


def test_the_sentence_with_fewest_words_left_wins(catalogue: Catalogue) -> None:
    assert catalogue.translated("soundings scatter 3 times as much as roll").startswith("横摇的")


def test_a_value_may_not_become_a_pattern(catalogue: Catalogue) -> None:
    assert catalogue.translated("the clock is {0}\\1 late") == "时钟晚 {0}\\1"


def test_data_of_any_length_come_back_at_once(catalogue: Catalogue) -> None:
    text = "no " * 3000
    assert catalogue.translated(text) == text
