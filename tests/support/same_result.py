"""Whether two sessions, calibrated by the command line, give one result."""

from pathlib import Path
from typing import Any

import numpy as np

from tests.support.places import poolcal, result_of, sigmas


def values(block: dict[str, Any]) -> np.ndarray:
    return np.array([*block["correction"]["rotation_vector_deg"], *block["correction"]["lever_arm_m"]])


def run(session: Path) -> dict[str, Any]:
    folder = session.with_name(session.name + ".run")
    told = poolcal("run", session, "--config", session / "pool.yaml", "--run", folder, "--jobs", 1)
    assert told.status == 0, told.err + told.out
    return result_of(folder)


def same(one: dict[str, Any], other: dict[str, Any], of_sigma: float) -> None:
    """Methods with sigmas to a share of them, the patent's to the same lengths and angles."""
    allowed = of_sigma * sigmas(one["mbes"])
    for method in one["methods"]:
        if one["methods"][method]["mount"] is None:
            assert other["methods"][method]["mount"] is None
            continue
        difference = np.abs(values(one["methods"][method]) - values(other["methods"][method]))
        assert np.all(difference <= allowed * (1 if method == "adjustment" else 10)), (method, difference / allowed)
