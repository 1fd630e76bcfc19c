"""Simulated sessions in memory, made once a worker."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from pipeline.simulation.session import SimulatedSession
from tests.support.mount_errors import mount_error
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

    def errors(block: Mapping[str, Any], truth: Mapping[str, Any]) -> np.ndarray:
        return mount_error(block, truth) * np.repeat([np.degrees(1.0), 1000.0], 3)

    return errors
