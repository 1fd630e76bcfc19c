"""The adjustment's sigmas against the Cramér-Rao bound, which knows nothing of it: true poses, rays and noise."""

import json
from dataclasses import replace

import numpy as np
import pytest

from pipeline.config.pool import Segment
from pipeline.config.yaml_models import parse
from pipeline.simulation.scenario import Scenario
from tests.support.effort import often
from tests.support.simulated import THIN, calibrated, made, merged
from tools.bound import bound
from tools.campaigns import DRIFT, WHITE

SECTORS = [{"to_deg": 15.0, "tilt_deg": 5.0}, {"to_deg": 90.0, "tilt_deg": -5.0}]
SHARP = {"margin_m": 0.03, "edge_ramp_m": 0.0}  # the bound takes a ramp for a limit in its middle, which is not exact
KINDS = [
    ({"ins": WHITE["ins"]}, SHARP),
    ({"ins": {}}, SHARP),
    ({"ins": DRIFT}, SHARP),
    # of few soundings on tops, those that a beam's noise moves over a limit would matter: so limits that leave more
    ({"mbes": {"format": "parquet", "sectors": SECTORS}}, SHARP | {"side_lobe_widths": 0.5}),
]


@pytest.mark.thorough
@pytest.mark.parametrize(("scenario", "segment"), often(KINDS[2:3], KINDS))
def test_the_random_sigmas_are_those_of_the_best_estimator(scenario, segment):
    scenario = merged(scenario, {"ins": {"rate_hz": 200.0}})
    session = made(scenario, seed=3)
    ins = session.session["ins"] | {"drift_within": {"sigmas": 1.0, "time_constant": 1.0}}  # the bound knows them, too
    session = replace(session, session=session.session | {"ins": ins})
    result = json.loads(calibrated(session, pool={"segment": segment})["report/calibration.json"])
    covariance = np.array(result["methods"]["adjustment"]["covariance"])
    made_of = parse(Scenario, merged({"name": "test"}, THIN, scenario), "test")
    least = bound(made_of, 3, segment=Segment(**segment))
    share = np.sqrt(np.diag(covariance) / np.diag(least))
    assert share.min() > 0.97, share  # no smaller: they would be too good to be true
    # labels keep from edges by a beam's noise too: 2 to 18 % fewer soundings on a face
    assert share.max() < 1.05, share
    correlation, expected = (one / np.sqrt(np.outer(np.diag(one), np.diag(one))) for one in (covariance, least))
    np.testing.assert_allclose(correlation, expected, atol=0.03)
