"""The INS's own sigmas through the stages: into a table, and in place of the session's drift."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.artefacts.streams import Chunk, MemoryPart, Stream
from pipeline.config.pool import Ingest, TargetPlace
from pipeline.config.recording import Recording, Recordings
from pipeline.errors import RawDataError
from pipeline.run.stage_protocol import run_in_memory
from pipeline.simulation.session import SimulatedSession
from stages import ingest
from tests.support.simulated import calibrated, made

NS = 1_000_000_000
FIGURES = {"north_m": 0.02, "east_m": 0.02, "up_m": 0.03, "roll_deg": 0.015, "pitch_deg": 0.015, "heading_deg": 0.04}
DRIFT = {"horizontal_m": 0.02, "vertical_m": 0.03, "roll_pitch_deg": 0.015, "heading_deg": 0.04}


def table(t_ns: np.ndarray) -> pd.DataFrame:
    return pd.DataFrame({"t_ns": t_ns} | {name: np.full(len(t_ns), value) for name, value in FIGURES.items()})


def session_with(ins: dict[str, Any]) -> SimulatedSession:
    session = made({"ins": {"drift": DRIFT}}, seed=1)
    about = {key: value for key, value in session.session["ins"].items() if key != "drift"}
    return replace(session, session=session.session | {"ins": about | ins})


@pytest.mark.thorough
def test_files_say_what_the_session_would_have_said() -> None:
    session = session_with({})
    t_ns = session.ins["t_ns"][:: len(session.ins["t_ns"]) // 300]

    def told(key: str, value: Any) -> Any:
        return table(t_ns) if key == "ingest/ins_sigmas" else value

    by_files = calibrated(session, changed=told)
    by_session = calibrated(session_with({"drift": DRIFT}))
    assert len(by_session["ingest/ins_sigmas"]) == 0
    for key in ("adjust/estimate", "adjust/covariance", "adjust/drift", "adjust/geometry"):
        numbers = [found[key].select_dtypes("number") for found in (by_files, by_session)]
        np.testing.assert_allclose(*numbers, rtol=1e-6, atol=1e-12)
    of_files, of_session = (json.loads(found["report/calibration.json"]) for found in (by_files, by_session))
    assert of_files["ins_drift"] == {name: pytest.approx(value) for name, value in DRIFT.items()} | {
        "time_constant_s": 200.0, "from_files": list(DRIFT)
    }  # fmt: skip
    assert of_session["ins_drift"] == DRIFT | {"time_constant_s": 200.0, "from_files": []}


# --- ingest ----------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Log:
    """An INS log, or an accuracy file (no columns of poses)."""

    name: str
    columns: dict[str, np.ndarray]
    sigmas: dict[str, np.ndarray]

    def chunks(self) -> Iterator[Chunk]:
        yield Chunk(self.columns, {}, self.sigmas)


def ingested(quiet: SimulatedSession, *more: Log) -> Any:
    raw = {"ins": quiet.ins, "laser": quiet.laser, "mbes": quiet.mbes}
    streams = {name: Stream((MemoryPart(name, columns),)) for name, columns in raw.items()}
    streams["ins"] = Stream((*streams["ins"].parts, *more))
    recording = Recording(files=("a",), format="table", latency_s=0.0)
    target = TargetPlace(origin=quiet.pool["target"]["origin"], azimuth_deg=0.0)
    config = ingest.Config(target, Ingest(), Recordings(ins=recording, laser=recording, mbes=recording))
    return run_in_memory(ingest, ingest.Inputs(**streams), config)


def accuracy(t_ns: np.ndarray) -> Log:
    return Log("b.smr", {}, {name: column.to_numpy() for name, column in table(t_ns).items()})


def test_rows_of_several_files_are_sorted_thinned_and_cut(quiet: SimulatedSession) -> None:
    start, end = int(quiet.ins["t_ns"][0]), int(quiet.ins["t_ns"][-1])
    first = start // (NS // 2) * (NS // 2)
    t_ns = first + np.arange(-20, 40) * NS // 4
    found = ingested(quiet, accuracy(t_ns[30:]), accuracy(t_ns[:30]))
    kept = found.ins_sigmas["t_ns"].to_numpy()
    assert np.all(np.diff(kept) == NS // 2)
    assert kept[0] >= start
    assert kept[-1] == first + 19 * NS // 2
    assert found.ins_sigmas["heading_deg"].tolist() == [0.04] * len(kept)
    counts = found.counts.set_index(["source", "reason"])["count"]
    assert counts["ins", "accuracy outside the INS's time"] == 30 - len(kept)
    assert counts["ins", "used"] == len(quiet.ins["t_ns"])
    files = found.files.set_index("file")
    assert files.loc["b.smr", "sensor"] == "accuracy"
    assert files.loc["b.smr", "records"] == 30
    assert end > kept[-1]


def test_sigmas_in_the_log_itself(quiet: SimulatedSession) -> None:
    later = {name: values[-1:] for name, values in quiet.ins.items()} | {"t_ns": quiet.ins["t_ns"][-1:] + NS}
    found = ingested(quiet, Log("b.gps", later, accuracy(quiet.ins["t_ns"][5:6]).sigmas))
    assert found.ins_sigmas["t_ns"].tolist() == [quiet.ins["t_ns"][5]]
    assert found.files.set_index("file").loc["b.gps", "sensor"] == "ins"


@pytest.mark.parametrize("shift_s", [-1e6, 1e6])
def test_accuracies_of_another_time_are_refused(shift_s: float, quiet: SimulatedSession) -> None:
    with pytest.raises(RawDataError, match=r"b\.smr: no time overlap: ins .* accuracy .*; give the one of this SBET"):
        ingested(quiet, accuracy(quiet.ins["t_ns"][:10] + round(shift_s) * NS))


def test_accuracies_of_which_none_is_usable_are_refused(quiet: SimulatedSession) -> None:
    with pytest.raises(RawDataError, match=r"b\.smr: no usable accuracy record"):
        ingested(quiet, Log("b.smr", {}, {}))
