"""One sentence on what limits each value."""

from typing import Any

import numpy as np

from pipeline.adjustment.error_sources import ERROR_SOURCES, OWNERS
from pipeline.report.sigma_sources import NOISE
from pipeline.results.pages.limiting_errors import CAUSES, IN_WORDS, limiting_sentences
from pipeline.results.pages.mount_tables import Quantity

NAMES = ("roll", "pitch", "yaw", "x", "y", "z")


def rows(sigma_deg: float, sigma_m: float) -> list[Any]:
    sigmas = [Quantity(sigma_deg, "deg")] * 3 + [Quantity(sigma_m, "m")] * 3
    return [{"name": name, "sigma_total": sigma} for name, sigma in zip(NAMES, sigmas, strict=True)]


def test_every_source_of_errors_has_its_words() -> None:
    assert {source.beginning for source in ERROR_SOURCES} == set(CAUSES)
    assert {NOISE, OWNERS["laser_mount"], *(source.words for source in ERROR_SOURCES)} == set(IN_WORDS)


def test_the_largest_is_named_for_each_value() -> None:
    """The sources are in the order pitch, roll, yaw, x, y, z, the sentences in that of the report."""
    sources = {
        NOISE: np.array([1.0, 3.0, 1.0, 1.0, 1.0, 1.0]),
        "wet faces against dry ones": np.array([3.0, 1.0, 1.2, 0.0, 0.0, 0.0]),
        "sound speed": np.array([0.0, 0.0, 1.1, 0.0, 0.0, 0.9]),
    }
    roll, pitch, yaw, x, _, z = limiting_sentences(sources, rows(0.0261, 0.0043))
    assert roll == (
        "Roll is known to ±0.051 ° (95 %); most of that comes from the noise of the sensors and the INS: "
        "more passes make it smaller"
    )
    assert pitch.endswith(
        "; most of that comes from how the wet faces may stand against the dry ones: survey them below the water"
    )
    assert "; the largest part of that comes from how the wet faces" in yaw  # 1.44 of 3.65
    assert x.startswith("Lever arm x is known to ±8.4 mm (95 %); most of that comes from the noise")
    assert "most of that comes from the noise" in z  # 1 of 1.81


def test_on_rough_walls_more_passes_do_not_help() -> None:
    sources = {NOISE: np.ones(6), "wet faces against dry ones": np.array([3.0, *np.zeros(5)])}
    roll, pitch, *_ = limiting_sentences(sources, rows(0.0261, 0.0043), rough=True)
    assert roll.endswith("every pass sees a rough wall's bumps again; more walls make it smaller")
    assert pitch.endswith("survey them below the water")


def test_without_sigmas_there_is_nothing_to_say() -> None:
    assert list(limiting_sentences({}, rows(0.01, 0.001))) == []
    nan = float("nan")
    assert list(limiting_sentences({NOISE: np.ones(6)}, rows(nan, nan))) == []
