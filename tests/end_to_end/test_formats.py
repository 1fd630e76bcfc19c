"""One session in every format gives one calibration."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.gps_time import NS, WEEK_NS
from pipeline.simulation.scenario import load_scenario
from pipeline.simulation.session import simulate_session as simulate_in_memory
from tests.support.effort import often
from tests.support.files import ie_files
from tests.support.places import Place, errors, result_of, sigmas, simulate
from tests.support.same_result import run, same
from tests.support.tables import write_tables

# Every format of each sensor; files of one sensor do not meet those of another before ingest has read them.
FILES: dict[str, dict[str, Any]] = {
    "inspva, las in week seconds, r2s": {
        "ins": {"format": "inspva"}, "laser": {"time": "week_seconds"}, "mbes": {"format": "r2s"},
    },
    "inspvaa, laz, xtf without intensity": {
        "ins": {"format": "inspvaa"}, "laser": {"format": "laz"}, "mbes": {"intensity": False},
    },
    "inspvasa, laz in week seconds": {
        "ins": {"format": "inspvasa"}, "laser": {"format": "laz", "time": "week_seconds"},
    },
    "sbet, one a pass, las in ECEF": {
        "ins": {"format": "sbet", "files": "pass"}, "laser": {"frame": "EPSG:4978"},
    },
}
EQUIDISTANT: dict[str, dict[str, Any]] = {  # other beams than equi-angle ones, so a calibration of its own
    "A2 in xtf": {"mbes": {"spacing": "equidistant"}},
    "A2 bare": {"mbes": {"spacing": "equidistant", "format": "r2s"}},
}


@pytest.mark.parametrize("what", often(list(FILES)[::3], list(FILES)))
def test_files(what: str, tmp_path: Path, undisturbed: tuple[Path, Any]) -> None:
    """Rounding differs (ASCII to 1e-9 deg, ECEF to 0.1 mm): a hundredth of a sigma.

    Week seconds are 30 ns off: points recorded at the very moment of an INS record count to the other step, and the
    variance factors, which are taken step by step, are those of another partition.
    """
    session = simulate(tmp_path / "session", **FILES[what])
    tolerance = 0.05 if "ECEF" in what else 0.03 if "week" in what else 0.01
    same(result_of(undisturbed[0]), run(session), tolerance)


@pytest.mark.thorough
def test_equidistant_beams(tmp_path: Path, truth: dict[str, Any]) -> None:
    bare, in_xtf = (run(simulate(tmp_path / f"session_{k}", **EQUIDISTANT[k])) for k in EQUIDISTANT)
    same(bare, in_xtf, 1e-6)
    assert np.all(np.abs(errors(bare["mbes"], truth)) < 4 * sigmas(bare["mbes"]))


def test_inertial_explorer(small: Path, tmp_path: Path, undisturbed: tuple[Path, Any]) -> None:
    """The INS's numbers, as simulated, in sixtieths, to 0.01 mm and a millionth of a degree."""
    simulated = simulate_in_memory(load_scenario(small.with_name("session.scenario.yaml")), 1)
    place = Place(small, tmp_path)
    place.mend()
    names = ("latitude", "longitude", "roll", "pitch", "azimuth")
    latitude, longitude, roll, pitch, heading = (np.degrees(simulated.ins[f"{name}_rad"]) for name in names)
    seconds = (simulated.ins["t_ns"] - ie_files.WEEK * WEEK_NS) / NS
    columns = (seconds, latitude, longitude, simulated.ins["height_m"], roll, pitch, heading)
    rows = [ie_files.Row(*map(float, row)) for row in zip(*columns, strict=True)]
    finer: ie_files.Columns = {
        "GPSTime": ("(sec)", lambda row: f"{row.of_week:.9f}"), "H-Ell": ("(m)", lambda row: f"{row.height:.5f}")
    }  # fmt: skip
    place.raw("ins").write_bytes(ie_files.export(ie_files.LAYOUTS["sixtieths"] | finer, rows))
    place.edit_session("ins", format="inertial_explorer")
    same(result_of(undisturbed[0]), run(place.session), 0.05)


@pytest.mark.parametrize(("kind", "weeks"), often([("csv", True)], [("parquet", False), ("csv", True)]))
def test_tables(kind: str, weeks: bool, small: Path, tmp_path: Path, undisturbed: tuple[Path, Any]) -> None:
    """The raw numbers themselves: what they were before they were rounded into instrument files."""
    scenario = load_scenario(small.with_name("session.scenario.yaml"))
    place = Place(small, tmp_path)
    write_tables(simulate_in_memory(scenario, 1), place.session, kind, weeks=weeks)
    same(result_of(undisturbed[0]), run(place.session), 0.05)
