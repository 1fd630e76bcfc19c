"""Which language is spoken: --lang, else POOLCAL_LANG, else the locale, else English."""

import os

import pytest

from pipeline.errors import ConfigError
from pipeline.language.chosen import choose, language, languages, translated
from pipeline.language.html_text import translated_page
from stages.cli import call


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("POOLCAL_LANG", "LC_ALL", "LC_MESSAGES", "LANG"):
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)


@pytest.mark.parametrize(
    ("environment", "asked", "spoken"),
    [
        ({}, None, "en"),
        ({"LANG": "zh_CN.UTF-8"}, None, "zh"),
        ({"LANG": "de_DE.UTF-8"}, None, "en"),
        ({"LANG": "zh_CN.UTF-8", "LC_ALL": "C.UTF-8"}, None, "en"),
        ({"LANG": "zh_CN.UTF-8", "POOLCAL_LANG": "en"}, None, "en"),
        ({"POOLCAL_LANG": "zh_CN"}, None, "zh"),
        ({"POOLCAL_LANG": "zh"}, "en", "en"),
        ({}, "zh", "zh"),
        ({"LANG": "C"}, "zh-CN", "zh"),
    ],
)
def test_language(monkeypatch: pytest.MonkeyPatch, environment: dict[str, str], asked: str | None, spoken: str) -> None:
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    choose(asked)
    assert language() == spoken


def test_the_choice_reaches_child_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POOLCAL_LANG", "en")
    choose("zh")
    assert os.environ["POOLCAL_LANG"] == "zh"


def test_there_are_english_and_chinese() -> None:
    assert languages() == ["en", "zh"]


def test_an_unknown_language_is_refused_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["verify", "nowhere", "--lang", "tlh"]) == 2
    assert capsys.readouterr().err == "poolcal: --lang tlh: there is no such language; choose one of en, zh\n"


def test_a_wrong_variable_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POOLCAL_LANG", "xx")
    with pytest.raises(ConfigError, match="POOLCAL_LANG=xx"):
        choose(None)


def test_a_page_keeps_its_markup_and_its_data(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POOLCAL_LANG", "zh")
    rejected = translated("rejected")
    assert rejected != "rejected"
    page = (
        '<!DOCTYPE html><html lang="en"><head><style>p {x: "rejected"}</style></head><body><p>rejected</p>'
        '<p translate="no">rejected <b>rejected</b></p><code>rejected</code><img alt="rejected" src="a">'
        "<p>&lt;b&gt; a_<wbr>b &amp; &#8211;</p>"
        "<p><b>rejected</b> (<i>rejected</i>, 1.5); <i>rejected</i>.</p></body></html>"
    )
    turned = translated_page(page)
    assert f"<p>{rejected}</p>" in turned
    assert '<p translate="no">rejected <b>rejected</b></p><code>rejected</code>' in turned
    assert f'<img alt="{rejected}" src="a">' in turned
    assert 'p {x: "rejected"}' in turned
    assert "<p>&lt;b&gt; a_b &amp; –</p>" in turned
    assert f"<b>{rejected}</b>（<i>{rejected}</i>, 1.5); <i>{rejected}</i>。</p>" in turned
    assert '<html lang="zh">' in turned


def test_an_english_page_stays_byte_for_byte() -> None:
    page = "<p>rejected &#8211; a_<wbr>b</p>"
    assert translated_page(page) is page
