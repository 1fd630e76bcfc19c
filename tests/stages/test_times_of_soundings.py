"""Soundings have the time of their ping's transmission. Other times would turn the yaw, and nothing else would show."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_models import parse
from pipeline.errors import RawDataError
from pipeline.simulation.session import SimulatedSession
from stages.in_memory import calibrate_in_memory

MS = 1_000_000


def ingested(session: SimulatedSession, mbes: Mapping[str, np.ndarray]) -> dict[str, Any]:
    raw = {"ins": session.ins, "laser": session.laser, "mbes": mbes}
    settings = parse(SessionConfig, session.session, "session"), parse(PoolConfig, session.pool, "pool")
    return calibrate_in_memory(*settings, raw, until="ingest")


def later(session: SimulatedSession, share: float, unit_ns: int = 1) -> dict[str, np.ndarray]:
    """The soundings, each later by a share of its two-way time, in whole units; in the order of their times."""
    way_ns = np.asarray(session.mbes["two_way_time_s"]) * 1e9
    t_ns = np.rint((session.mbes["t_ns"] + share * way_ns) / unit_ns).astype(np.int64) * unit_ns
    order = np.argsort(t_ns, kind="stable")
    return {name: np.asarray(column)[order] for name, column in {**session.mbes, "t_ns": t_ns}.items()}


@pytest.mark.parametrize(("share", "words"), [(1.0, "less their two-way"), (0.5, "less half their two-way")])
@pytest.mark.parametrize("unit_ns", [1, MS])
def test_times_of_reception_are_refused(noisy: SimulatedSession, share: float, words: str, unit_ns: int) -> None:
    with pytest.raises(RawDataError, match=f"mbes: the soundings do not have the time of .*{words} times"):
        ingested(noisy, later(noisy, share, unit_ns))


@pytest.mark.parametrize("unit_ns", [1, MS, 10 * MS])
def test_times_of_transmission_are_read(noisy: SimulatedSession, unit_ns: int) -> None:
    assert ingested(noisy, later(noisy, 0.0, unit_ns))["ingest/passes"]["pass"].nunique() > 1


def test_one_range_decides_nothing(noisy: SimulatedSession) -> None:
    """All echoes at one distance: a latency, which other tests find."""
    same = dict(later(noisy, 0.0)) | {"two_way_time_s": np.full(len(noisy.mbes["t_ns"]), 0.005)}
    ingested(noisy, same)
