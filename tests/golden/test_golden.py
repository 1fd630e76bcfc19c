"""Tables of one fixed session, with a tolerance a column: what changes here has changed for users.

``python -m tests.golden.test_golden`` writes them anew, once the change is understood.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.support.simulated import calibrated, made

FOLDER = Path(__file__).parent
# Absolute tolerance of each column that is compared; the others must be equal. Far below the sigmas of the session.
TOLERANCES = {
    "report/calibration": {"coarse": 1e-12, "total": 2e-5, "change": 2e-5, "correction": 2e-5, "sigma": 1e-5},
    "segment/target_pose": {
        "origin_x_pool_m": 1e-6,
        "origin_y_pool_m": 1e-6,
        "origin_z_pool_m": 1e-6,
        "azimuth_correction_deg": 1e-5,
        "agreement_m2": 1e-2,
        "rival_agreement_m2": 1e-2,
        "points": 3,
    },
    "ingest/passes": {"distance_m": 1e-6, "duration_s": 1e-9, "azimuth_deg": 1e-6},
    "adjust/groups": {"count": 5, "variance_factor": 1e-3, "cut": 3, "reduced": 10},
}
KEYS = {"report/calibration": ["method", "parameter"], "adjust/groups": ["group"], "ingest/passes": ["pass"]}


def tables() -> dict[str, pd.DataFrame]:
    found = calibrated(made({"ins": {"rate_hz": 200.0}}, seed=1))
    return {name: found[name][[*KEYS.get(name, []), *columns]] for name, columns in TOLERANCES.items()}


def path_of(name: str) -> Path:
    return FOLDER / f"{name.replace('/', '_')}.csv"


@pytest.fixture(scope="module")
def current():
    return tables()


@pytest.mark.parametrize("name", TOLERANCES)
def test_the_session_gives_what_it_gave(name, current):
    golden, now = pd.read_csv(path_of(name)), current[name]
    assert list(golden.columns) == list(now.columns)
    for column in golden.columns:
        if column in TOLERANCES[name]:
            np.testing.assert_allclose(
                now[column], golden[column], rtol=0, atol=TOLERANCES[name][column], err_msg=column
            )
        else:
            assert now[column].astype(str).tolist() == golden[column].astype(str).tolist(), column


if __name__ == "__main__":
    for name, table in tables().items():
        table.to_csv(path_of(name), index=False)
