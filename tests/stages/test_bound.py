"""The adjustment's sigmas against the Cramér-Rao bound, which knows nothing of it: true poses, rays and noise."""

import json

import numpy as np
import pytest

from pipeline.parsing import parse
from pipeline.simulation.scenario import Scenario
from tests.effort import often
from tests.stages.conftest import THIN, calibrated, made, merged
from tools.bound import bound
from tools.montecarlo import DRIFT, WHITE


@pytest.mark.parametrize("ins", often([DRIFT], [WHITE["ins"], {}, DRIFT]))
def test_the_random_sigmas_are_those_of_the_best_estimator(ins):
    scenario = {"ins": ins}
    result = json.loads(calibrated(made(scenario, seed=3))["report/calibration.json"])
    covariance = np.array(result["methods"]["adjustment"]["covariance"])
    least = bound(parse(Scenario, merged({"name": "test"}, THIN, scenario), "test"), 3)
    share = np.sqrt(np.diag(covariance) / np.diag(least))
    assert share.min() > 0.97, share  # no smaller: they would be too good to be true
    assert share.max() < 1.03, share
    correlation, expected = (one / np.sqrt(np.outer(np.diag(one), np.diag(one))) for one in (covariance, least))
    np.testing.assert_allclose(correlation, expected, atol=0.03)
