"""Simulated sessions in memory, made once a worker."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from pipeline.simulation.session import SimulatedSession
from tests.support.simulated import QUIET, calibrated, made


@pytest.fixture(scope="session")
def quiet() -> SimulatedSession:
    """Without any noise, point beams."""
    return made(QUIET)


@pytest.fixture(scope="session")
def noisy() -> SimulatedSession:
    """The default scenario, thinned."""
    return made()


@pytest.fixture(scope="session")
def quiet_found(quiet: SimulatedSession) -> dict[str, Any]:
    """Every artefact of it. Nobody changes them."""
    return calibrated(quiet)


@pytest.fixture(scope="session")
def noisy_found(noisy: SimulatedSession) -> dict[str, Any]:
    """Every artefact of it. Nobody changes them."""
    return calibrated(noisy)


Errors = Callable[[Mapping[str, Any], Mapping[str, Any]], np.ndarray]


@pytest.fixture(scope="session")
def errors_of() -> Errors:
    """(6,): a method's block of calibration.json against the truth: rotation in degrees, lever arm in mm."""
    from scipy.spatial.transform import Rotation

    def errors(block: Mapping[str, Any], truth: Mapping[str, Any]) -> np.ndarray:
        R_true, R_found = np.array(truth["mbes"]["R_body_from_mbes"]), np.array(block["R_body_from_mbes"])
        rotation = Rotation.from_matrix(R_true @ R_found.T).as_rotvec(degrees=True)
        lever = 1000 * (np.array(truth["mbes"]["lever_arm_m"]) - np.array(block["lever_arm_m"]))
        return np.concatenate([rotation, lever])

    return errors
