"""The sample of the laser's points: it does not depend on how they are read, and it has its limit."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.artefacts.sampling import ALL, scattered
from pipeline.artefacts.streams import MemoryPart
from pipeline.config.session import SessionConfig
from pipeline.config.stage_settings import LaserPlacement
from pipeline.config.yaml_models import parse
from pipeline.errors import RawDataError
from pipeline.finding.kept_points import (
    DRAWN,
    FARTHEST_M,
    MOST,
    KeptPoints,
    drawn_points,
    first_limit,
    kept_points,
    level_context,
)
from pipeline.mount import mount_of
from pipeline.readers.las import LasPart
from pipeline.readers.track_tables import trajectory_table
from pipeline.simulation.session import SimulatedSession
from tests.support.simulated import made

TRACK = {"track": {"distances_m": [4.0, 7.0], "half_length_m": 3.6}}


@pytest.fixture(scope="module")
def session() -> SimulatedSession:
    return made(TRACK)


def kept(
    session: SimulatedSession, parts: int = 1, shift_ns: int = 0, limit: int = ALL, ends: np.ndarray | None = None
) -> KeptPoints:
    laser = parse(SessionConfig, session.session, "session").laser
    columns = dict(session.laser) | {"t_ns": session.laser["t_ns"] + shift_ns}
    ends = np.linspace(0, len(columns["t_ns"]), parts + 1).astype(int) if ends is None else ends
    pieces = [
        MemoryPart(str(k), {name: values[ends[k] : ends[k + 1]] for name, values in columns.items()})
        for k in range(len(ends) - 1)
    ]
    context = level_context(trajectory_table([session.ins])[0])
    drawn = [drawn_points(piece, limit) for piece in pieces]
    return kept_points(drawn, context, LaserPlacement(mount=laser.mount, frame=laser.frame))


@pytest.mark.parametrize("most", [10**9, 5000])
def test_the_sample_is_the_same_however_the_points_are_divided(
    session: SimulatedSession, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.finding.kept_points.MOST", most)
    one, seven = kept(session, 1), kept(session, 7)
    assert one.read == seven.read == len(session.laser["t_ns"])
    np.testing.assert_array_equal(one.t_ns, seven.t_ns)
    np.testing.assert_array_equal(one.level_m, seven.level_m)
    assert np.all(np.diff(one.t_ns) >= 0)
    assert np.linalg.norm(one.own_m, axis=1).max() <= FARTHEST_M
    if most < one.read:
        assert most / 4 < len(one) <= most
        halves = np.histogram(one.t_ns, 4, (session.laser["t_ns"].min(), session.laser["t_ns"].max()))[0]
        everything = np.histogram(session.laser["t_ns"], 4)[0]
        np.testing.assert_allclose(halves / halves.sum(), everything / everything.sum(), atol=0.03)


def test_points_are_where_the_ins_puts_them(session: SimulatedSession) -> None:
    found = kept(session, 2)
    mount = mount_of(parse(SessionConfig, session.session, "session").laser.mount)
    lever_arm_m = float(np.linalg.norm(mount.lever_arm_body_m))
    away = np.linalg.norm(found.level_m - found.context.trajectory.poses_at(found.t_ns)[0], axis=1)
    np.testing.assert_allclose(away, np.linalg.norm(found.own_m, axis=1), atol=lever_arm_m)


def test_scattered_numbers_are_even_and_their_own() -> None:
    numbers = scattered(np.arange(100_000) * 8333)
    assert len(np.unique(numbers)) == 100_000
    np.testing.assert_allclose(np.histogram(numbers.astype(float), 10, (0, 2.0**64))[0], 10_000, rtol=0.04)


def test_another_clock_is_one_line(session: SimulatedSession) -> None:
    with pytest.raises(RawDataError, match=r"none of .* points lies within 50 m of the boat while the INS recorded"):
        kept(session, 1, shift_ns=3_600_000_000_000)


def stretch(start: int, stop: int) -> LasPart:
    return LasPart(Path("a.laz"), "a.laz", True, start, stop, 0, "laser", "", 0.0, None, None, 0.0)


def test_of_large_files_few_points_leave_the_reader() -> None:
    """By tenths, so that nearly as many as may leave it do; of other files nobody knows the number."""
    assert first_limit([stretch(0, DRAWN)]) == ALL
    assert first_limit([stretch(0, DRAWN), stretch(DRAWN, DRAWN + 2)]) == ALL - ALL // 10
    share = first_limit([stretch(0, 4_000_000), stretch(4_000_000, 8 * DRAWN)]) / ALL
    assert 0.9 * 1 / 8 < share <= 1 / 8
    assert first_limit([MemoryPart("0", {"t_ns": np.zeros(10 * DRAWN, dtype=np.int8)})]) == ALL
    assert DRAWN >= 2 * MOST  # half of the points may be far


def test_the_sample_is_the_same_if_fewer_points_leave_the_reader(
    session: SimulatedSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.finding.kept_points.MOST", 2000)
    whole = kept(session, 2)
    fewer = kept(session, 2, limit=ALL // 4)
    assert fewer.read == whole.read
    np.testing.assert_array_equal(fewer.t_ns, whole.t_ns)
    np.testing.assert_array_equal(fewer.level_m, whole.level_m)


def test_parts_of_different_sizes_have_the_same_share(
    session: SimulatedSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of each pass a part: the larger one draws more points than may leave it, the smaller one does not."""
    ends = session.laser["t_ns"].searchsorted(session.laser["t_ns"].min() + np.array([0, 5, 10**6]) * 10**9)
    small, large = np.diff(ends)
    monkeypatch.setattr("pipeline.finding.kept_points.DRAWN", large // 4)
    assert small < large // 4
    found = kept(session, ends=ends)
    between = session.laser["t_ns"][ends[1]]
    shares = np.array([np.sum(found.t_ns < between) / small, np.sum(found.t_ns >= between) / large])
    assert shares[0] == pytest.approx(shares[1], rel=0.15)
    assert shares[1] < 0.25


def test_of_a_part_that_tells_no_number_a_bounded_sample_leaves_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipeline.finding.kept_points.DRAWN", 1000)
    t_ns = np.arange(400_000) * 8333
    columns = {"t_ns": t_ns} | {f"{axis}_m": np.arange(len(t_ns), dtype=float) for axis in "xyz"}
    read, limit, drawn = drawn_points(MemoryPart("0", columns), ALL)
    assert read == len(t_ns)
    assert limit < ALL
    assert 400 < len(drawn["t_ns"]) <= 1000
    np.testing.assert_array_equal(drawn["drawn"], scattered(drawn["t_ns"]))
    np.testing.assert_array_equal(drawn["x_m"], drawn["t_ns"] // 8333)
    assert drawn["drawn"].max() <= np.sort(scattered(t_ns))[len(drawn["t_ns"]) - 1]  # the smallest of all
