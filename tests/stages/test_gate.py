"""The gate of the soundings under noise that differs from family to family."""

import json
from typing import Any

import numpy as np
import pytest

from pipeline.simulation.session import SimulatedSession
from tests.support.simulated import calibrated, made, mount_within_its_sigmas


def gate_and_scatter(found: Any) -> tuple[float, float]:
    """The gate, and the largest RMS of the soundings on a family."""
    cells = found["adjust/cells"].query("sensor == 'mbes'")
    squares = (cells["rms_m"] ** 2 * cells["count"]).groupby(cells["family"]).sum()
    rms_m = np.sqrt(squares / cells.groupby("family")["count"].sum())
    return float(found["segment/provisional_mount"]["gate_m"].iloc[0]), float(rms_m.max())


@pytest.mark.thorough
def test_a_gate_is_widened_for_the_noisiest_family(errors_of: Any) -> None:
    """Soundings of the slanted faces nine times as noisy as the wall's: as the search left the gate, ±1.1 of their
    sigmas, the mount would be wrong by 0.25° and 15 mm, seven total sigmas, and accepted."""
    session: SimulatedSession = made({"mbes": {"slanted_noise": 9.0}}, seed=3)
    found = calibrated(session)
    gate_m, scatter_m = gate_and_scatter(found)
    assert gate_m > 4 * scatter_m > 0.15
    result = json.loads(found["report/calibration.json"])
    assert mount_within_its_sigmas(result, errors_of(result["mbes"], session.truth), 3)
    assert "noise_cut_by_gate" not in result["reason_codes"]


@pytest.mark.thorough
def test_noise_that_no_gate_holds_is_a_reason() -> None:
    """Forty times: between parallel faces half a metre apart there is no room for a gate of three sigmas."""
    found = calibrated(made({"mbes": {"slanted_noise": 40.0}}, seed=3))
    result = json.loads(found["report/calibration.json"])
    assert "noise_cut_by_gate" in result["reason_codes"]
