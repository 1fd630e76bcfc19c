"""An SBET with its accuracy file, from session.yaml to calibration.json."""

import struct
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml

from tests.support.places import Place, edit, poolcal, simulate

RMS = (0.02, 0.02, 0.03, 0.1, 0.1, 0.1, 0.9, 0.9, 2.4)  # north, east, down; velocities; roll, pitch, heading: 1/60 deg
FROM_FILES = {"horizontal_m": 0.02, "vertical_m": 0.03, "roll_pitch_deg": 0.015, "heading_deg": 0.04}


def write(path: Path, seconds: np.ndarray, rms: tuple[float, ...] = RMS) -> None:
    path.write_bytes(b"".join(struct.pack("<10d", second, *rms) for second in seconds))


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Whose session.yaml says nothing of the drift."""
    return simulate(tmp_path_factory.mktemp("sbet") / "session", ins={"format": "sbet"}, declare_sigmas=False)


@pytest.fixture
def place(template: Path, tmp_path: Path) -> Place:
    one = Place(template, tmp_path)
    one.mend()
    write(one.session / "ins" / "a.smr", seconds_of(one))
    one.edit_session("ins", accuracy=["ins/*.smr"])
    return one


def seconds_of(place: Place) -> np.ndarray:
    return np.fromfile(place.session / "ins" / "ins.sbet", "<f8").reshape(-1, 17)[::25, 0]


def test_the_files_figures_are_used_recorded_and_kept_up_to_date(place: Place) -> None:
    write(place.session / "ins" / "a.smr", seconds_of(place), (0.04, 0.04, *RMS[2:]))
    words = ("--session", place.session, "--config", place.config, "--jobs", 1)
    assert poolcal("stage", "ingest", place.run, *words).ran == ["ingest"]
    sigmas = pq.read_table(place.run / "ingest" / "ins_sigmas.parquet")
    assert sigmas["heading_deg"].to_numpy() == pytest.approx(np.full(len(sigmas), 0.04))

    write(place.session / "ins" / "a.smr", seconds_of(place))
    told = place.calibrate()
    assert told.status in (0, 1), told.err
    assert "ingest: ins/a.smr changed\n" in told.err
    assert told.ran[0] == "ingest"
    result = place.result()
    assert result["ins_drift"].pop("from_files") == list(FROM_FILES)
    assert result["ins_drift"] == pytest.approx(FROM_FILES | {"time_constant_s": 200.0})
    assert "ins/a.smr" in result["inputs"]
    settings = yaml.safe_load((place.run / "run.yaml").read_text(encoding="utf-8"))
    assert settings["session"]["ins"]["drift_from"] == "files"

    assert place.calibrate().ran == []
    place.edit_session("ins", drift={"horizontal_m": 0.5})
    last = place.calibrate()
    assert {"adjust", "report"} <= set(last.ran)
    assert "ingest" not in last.ran
    assert place.result()["ins_drift"]["horizontal_m"] == 0.5
    assert place.result()["ins_drift"]["from_files"] == []


@pytest.mark.parametrize(
    ("accuracy", "words"),
    [
        (["ins/*.rms"], ("session.yaml", "ins.accuracy", "'ins/*.rms' matches no file")),
        (["ins/ins.sbet"], ("ins.sbet", "SBET", "ins.accuracy")),
        (["../a.smr"], ("session.yaml", "ins.accuracy.0", "inside the session folder")),
        ("ins/a.smr", ("session.yaml", "ins.accuracy", "a list")),
    ],
)
def test_refused(accuracy: object, words: tuple[str, ...], place: Place) -> None:
    edit(place.session / "session.yaml", "ins", accuracy=accuracy)
    told = place.calibrate()
    assert told.status == 2
    (line,) = told.complaints
    for word in words:
        assert word in line, line


def test_of_another_time(place: Place) -> None:
    write(place.session / "ins" / "a.smr", seconds_of(place) + 20_000)
    told = place.calibrate()
    assert told.status == 2
    (line,) = told.complaints
    assert "a.smr: no time overlap" in line
