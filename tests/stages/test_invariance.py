"""The answer does not depend on the order of rows, on where on earth the pool lies, or on how parts are cut."""

import json

import numpy as np

from pipeline.artefacts.streams import MemoryPart, Stream
from pipeline.config.pool import FitPlanes
from pipeline.config.session import Mbes
from pipeline.config.yaml_models import parse
from pipeline.run.stage_protocol import run_in_memory
from stages import fit_planes
from tests.support.simulated import QUIET, calibrated, made


def estimate(found):
    return found["adjust/estimate"].set_index("unknown")[["value", "sigma"]].iloc[:6].to_numpy()


def test_the_order_of_rows_does_not_matter(noisy, noisy_found):
    rng = np.random.default_rng(0)

    def shuffled(columns):
        order = rng.permutation(len(columns["t_ns"]))
        return {name: values[order] for name, values in columns.items()}

    # Two sensors' rows in any order; the sample for searching is drawn by a hash of time and beam, not by position.
    other = estimate(calibrated(noisy, "adjust", raw={"laser": shuffled(noisy.laser), "mbes": shuffled(noisy.mbes)}))
    reference = estimate(noisy_found)
    assert (np.abs(other[:, 0] - reference[:, 0]) < 0.02 * reference[:, 1]).all()


def test_a_pool_on_the_other_side_of_the_earth(quiet, quiet_found, errors_of):
    """South of the equator, west of Greenwich, 3000 m up: the same result, to rounding."""
    origin = {"latitude_deg": -41.3, "longitude_deg": -174.9, "height_m": 3000.0}
    there = made(QUIET, {"target": {"a": 8.0, "b": 3.0, "c": 1.0, "e": 0.5, "azimuth_deg": 0.0, "origin": origin}})
    errors = []
    for session, found in ((quiet, quiet_found), (there, calibrated(there))):
        block = json.loads(found["report/calibration.json"])["methods"]["adjustment"]
        errors.append(errors_of(block, session.truth))
    np.testing.assert_allclose(errors[0][:3], errors[1][:3], atol=1e-5)
    np.testing.assert_allclose(errors[0][3:], errors[1][3:], atol=2e-3)


def test_planes_do_not_depend_on_how_the_stream_is_cut(noisy, noisy_found):
    found = noisy_found

    def cut(stream, pieces):
        columns = {
            name: np.concatenate([part.columns[name] for part in stream.parts]) for name in stream.parts[0].columns
        }
        split = {name: np.array_split(values, pieces) for name, values in columns.items()}
        return Stream(tuple(MemoryPart(str(k), {n: v[k] for n, v in split.items()}) for k in range(pieces)))

    config = fit_planes.Config(FitPlanes(), parse(Mbes, noisy.session["mbes"], "mbes"))
    tables = []
    for pieces in (1, 7):
        inputs = fit_planes.Inputs(
            found["segment/faces"],
            found["georeference/poses"],
            found["segment/target_pose"],
            cut(found["segment/laser_labelled"], pieces),
            cut(found["segment/soundings_labelled"], pieces),
        )
        tables.append(run_in_memory(fit_planes, inputs, config).planes)
    assert tables[0]["count"].tolist() == tables[1]["count"].tolist()
    for column in ("normal_x_target_1", "normal_y_target_1", "normal_z_target_1", "rms_m"):
        np.testing.assert_allclose(tables[0][column], tables[1][column], atol=1e-10)
