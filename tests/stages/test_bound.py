"""The adjustment's sigmas against the Cramér-Rao bound, which knows nothing of it: true poses, rays and noise."""

import json
from dataclasses import replace

import numpy as np
import pytest

from pipeline.config.yaml_models import parse
from pipeline.simulation.scenario import Scenario
from tests.support.effort import often
from tests.support.simulated import THIN, calibrated, made, merged
from tools.bound import bound
from tools.campaigns import DRIFT, WHITE

SECTORS = [{"to_deg": 15.0, "tilt_deg": 5.0}, {"to_deg": 90.0, "tilt_deg": -5.0}]
KINDS = [{"ins": WHITE["ins"]}, {"ins": {}}, {"ins": DRIFT}, {"mbes": {"format": "parquet", "sectors": SECTORS}}]


@pytest.mark.parametrize("scenario", often(KINDS[2:3], KINDS))
def test_the_random_sigmas_are_those_of_the_best_estimator(scenario):
    session = made(scenario, seed=3)
    ins = session.session["ins"] | {"drift_within": {"sigmas": 1.0, "time_constant": 1.0}}  # the bound knows them, too
    session = replace(session, session=session.session | {"ins": ins})
    near = {"segment": {"side_lobe_widths": 0.5}}  # the bound takes what lies near an inner corner
    result = json.loads(calibrated(session, pool=near)["report/calibration.json"])
    covariance = np.array(result["methods"]["adjustment"]["covariance"])
    least = bound(parse(Scenario, merged({"name": "test"}, THIN, scenario), "test"), 3)
    share = np.sqrt(np.diag(covariance) / np.diag(least))
    assert share.min() > 0.97, share  # no smaller: they would be too good to be true
    assert share.max() < 1.03, share
    correlation, expected = (one / np.sqrt(np.outer(np.diag(one), np.diag(one))) for one in (covariance, least))
    np.testing.assert_allclose(correlation, expected, atol=0.03)
