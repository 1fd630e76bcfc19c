"""A sonar with two heads, in memory: both come back, each within its sigmas; what is wrong with one is said of it."""

import dataclasses
import json
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from pipeline.errors import RawDataError
from pipeline.simulation.session import SimulatedSession
from tests.support.effort import often
from tests.support.mount_errors import rotation_error
from tests.support.simulated import QUIET, calibrated, made_with_heads, through, without_biases

FIRST = {"roll_deg": -48.8, "pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.30, "y_m": 0.20, "z_m": -2.01}
SECOND = {"roll_deg": -38.0, "pitch_deg": -0.9, "yaw_deg": 1.6, "x_m": -0.30, "y_m": -0.25, "z_m": -2.05}
BOTH = (FIRST, SECOND)
COARSE = {"ins": {"rate_hz": 50.0}, "laser": {"point_rate_hz": 2500.0}, "mbes": {"ping_rate_hz": 5.0}}
NOISE_TO_99_9 = 32.9  # χ² of twelve degrees of freedom


def result_of(found: Mapping[str, Any]) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(found["report/calibration.json"])
    return content


def errors(result: Mapping[str, Any], session: SimulatedSession) -> np.ndarray:
    """(heads, 6) true minus found, rad and m."""
    pairs = zip(session.truth["heads"], result["heads"], strict=True)
    return np.array(
        [
            [
                *rotation_error(true["R_body_from_mbes"], head["R_body_from_mbes"]),
                *np.subtract(true["lever_arm_m"], head["lever_arm_m"]),
            ]
            for true, head in pairs
        ]
    )


@pytest.fixture(scope="module")
def noisy_two() -> SimulatedSession:
    return made_with_heads(COARSE, mounts=BOTH)


@pytest.fixture(scope="module")
def found_two(noisy_two: SimulatedSession) -> dict[str, Any]:
    return calibrated(noisy_two)


@pytest.mark.thorough
def test_without_noise_both_heads_come_back() -> None:
    session = without_biases(made_with_heads(QUIET, mounts=BOTH))
    result = result_of(calibrated(session))
    assert result["verdict"] == "accepted", result["reasons"]
    error = np.abs(errors(result, session))
    assert np.degrees(error[:, :3]).max() < 1e-4
    assert error[:, 3:].max() < 1e-5


def test_with_noise_each_is_within_its_sigmas_and_both_within_their_common_ones(
    noisy_two: SimulatedSession, found_two: dict[str, Any]
) -> None:
    result = result_of(found_two)
    assert result["verdict"] == "accepted", result["reasons"]
    assert [head["name"] for head in result["heads"]] == ["mbes", "mbes_2"]
    error = errors(result, noisy_two)
    common = {name: np.array(result["heads_covariance"][name]) for name in ("covariance", "covariance_total")}
    for name, covariance in common.items():
        for number, head in enumerate(result["heads"]):
            own = slice(6 * number, 6 * number + 6)
            np.testing.assert_array_equal(covariance[own, own], head[name])
        sigma = np.sqrt(np.diag(covariance))
        assert np.abs(covariance / np.outer(sigma, sigma))[:6, 6:].max() > 0.3
    assert error.ravel() @ np.linalg.solve(common["covariance"], error.ravel()) < NOISE_TO_99_9
    assert np.all(np.linalg.eigvalsh(common["covariance_total"] - common["covariance"]) > -1e-12)


def test_the_first_head_s_keys_are_those_of_a_single_sonar(found_two: dict[str, Any]) -> None:
    result = result_of(found_two)
    first = result["heads"][0]
    assert all(result["mbes"][key] == first[key] for key in result["mbes"])
    assert result["methods"] == first["methods"]
    assert set(result["heads"][1]["methods"]) == set(result["methods"])
    row = result["passes"][0]
    assert row["soundings"] == row["soundings_mbes"] + row["soundings_mbes_2"]


def test_a_list_of_one_head_is_the_same_as_a_block() -> None:
    session = made_with_heads({"mbes": {"ping_rate_hz": 4.0}}, mounts=[FIRST])
    as_list = dataclasses.replace(session, session=session.session | {"mbes": [session.session["mbes"]]})
    block, listed = (calibrated(one) for one in (session, as_list))
    assert block["report/calibration.json"] == listed["report/calibration.json"]
    assert "heads" not in result_of(block)
    assert len(block["adjust/covariance"]) == 36


def test_the_methods_of_the_patent_have_each_head_s_own_planes(
    noisy_two: SimulatedSession, found_two: dict[str, Any]
) -> None:
    alone = noisy_two.session | {"mbes": noisy_two.session["mbes"][1]}
    single = dataclasses.replace(noisy_two, session=alone, mbes=noisy_two.further["mbes_2"][0], further={})
    expected = result_of(calibrated(single))["methods"]
    second = result_of(found_two)["heads"][1]["methods"]
    for method in ("patent_sequential", "patent_alternating", "patent_literal"):
        assert second[method] == expected[method]
    assert second["adjustment"]["mount"] != expected["adjustment"]["mount"]


@pytest.mark.parametrize("wrong", often([1], [0, 1]))
def test_a_head_whose_clock_is_off_is_named(noisy_two: SimulatedSession, wrong: int) -> None:
    """Its soundings are stamped 40 ms late: rejected, and the strongest cause is that head's clock."""
    name = ("mbes", "mbes_2")[wrong]
    late = noisy_two.raw[name] | {"t_ns": noisy_two.raw[name]["t_ns"] + 40_000_000}
    result = result_of(calibrated(noisy_two, raw={name: late}))
    assert result["verdict"] == "rejected"
    assert result["hypotheses"][0]["name"] == f"{name}_latency"
    if wrong:
        assert any("mbes_2: the sonar's clock" in reason for reason in result["reasons"])


def test_one_head_beyond_its_limits_rejects_the_whole_and_is_named(noisy_two: SimulatedSession) -> None:
    """Of the second head a ping in four is left: its sigmas are larger. The limit lies between both heads' rolls."""
    records = noisy_two.raw["mbes_2"]
    few = {name: values[records["ping"] % 4 == 0] for name, values in records.items()}
    found = calibrated(noisy_two, raw={"mbes_2": few})
    sigmas = [head["sigma_mount_total"] for head in result_of(found)["heads"]]
    limit = (sigmas[0]["roll_deg"] + sigmas[1]["roll_deg"]) / 2
    assert 1.1 * sigmas[0]["roll_deg"] < sigmas[1]["roll_deg"]
    verdict = {"max_sigma_deg": limit, "max_sigma_m": 1.0}
    known = through("adjust", found)
    result = result_of(calibrated(noisy_two, raw={"mbes_2": few}, pool={"verdict": verdict}, known=known))
    assert result["verdict"] == "rejected"
    assert [head["verdict"] for head in result["heads"]] == ["accepted", "rejected"]
    assert set(result["reason_codes"]) == {"sigma_above_limit"}
    assert all(reason.startswith("mbes_2: total sigma of ") for reason in result["reasons"])


def test_a_head_that_sees_nothing_in_the_passes_of_the_first_is_refused(noisy_two: SimulatedSession) -> None:
    """The first head records the first pass alone, the second the others."""
    ends = noisy_two.truth["passes"][0]["end_ns"]
    first, second = (noisy_two.raw[name] for name in ("mbes", "mbes_2"))
    raw = {
        "mbes": {name: values[first["t_ns"] <= ends] for name, values in first.items()},
        "mbes_2": {name: values[second["t_ns"] > ends] for name, values in second.items()},
    }
    with pytest.raises(RawDataError, match="mbes_2: none of its soundings on the target lies in a pass of the first"):
        calibrated(noisy_two, raw=raw)


@pytest.mark.thorough
def test_soundings_outside_the_passes_of_the_first_head_are_counted(noisy_two: SimulatedSession) -> None:
    """The first head records no second pass; what the second saw there is left out, and said."""
    start, end = (noisy_two.truth["passes"][1][key] for key in ("start_ns", "end_ns"))
    first = noisy_two.raw["mbes"]
    kept = (first["t_ns"] < start - 5_000_000_000) | (first["t_ns"] > end + 5_000_000_000)
    result = result_of(calibrated(noisy_two, raw={"mbes": {name: values[kept] for name, values in first.items()}}))
    (warning,) = (
        words
        for words, code in zip(result["warnings"], result["warning_codes"], strict=True)
        if code == "soundings_outside_passes"
    )
    left_out, of_all = (int(number.replace(",", "")) for number in re.findall(r"\b[0-9][0-9,]*", warning)[:2])
    assert 0.1 < left_out / of_all < 0.3  # one pass of four, at 8 m
    assert result["verdict"] == "accepted", result["reasons"]


def test_each_head_tells_its_systematic_errors_apart(found_two: dict[str, Any]) -> None:
    """Noise and the squares of the effects add up to the total covariance; errors that are common act on both heads."""
    result = result_of(found_two)
    assert result["heads"][0]["systematic"] == result["systematic"]
    of_heads = []
    for head in result["heads"]:
        effects = [column for block in head["systematic"].values() for column in block["effects"].values()]
        E = np.array(effects).T
        np.testing.assert_allclose(
            np.array(head["covariance"]) + E @ E.T, head["covariance_total"], rtol=1e-6, atol=1e-12
        )
        of_heads.append(E)
    cross = np.array(result["heads_covariance"]["covariance_total"]) - result["heads_covariance"]["covariance"]
    names = [name for block in result["systematic"].values() for name in block["effects"]]
    # those of the surfaces are roots of each head's own part: their product is no part across the heads
    kept = np.array([not name.startswith("surfaces_") for name in names])
    np.testing.assert_allclose(
        of_heads[0][:, kept] @ of_heads[1][:, kept].T, cross[:6, 6:], rtol=0.02, atol=0.02 * np.abs(cross).max()
    )
