"""Passes: gaps, reversals, and the direction of the track."""

import numpy as np
import pytest

from pipeline.maths.geometry.passes import estimate_azimuth, find_passes, pass_of, reversals, split_at_gaps

NS = 1_000_000_000


def seconds(*values):
    return (np.array(values) * NS).astype(np.int64)


def ramp(start, end, rate=50.0):
    return (np.arange(start, end, 1 / rate) * NS).astype(np.int64)


def test_a_gap_must_exceed_the_limit():
    t = seconds(0, 5, 10.1)
    assert split_at_gaps(t, 5 * NS) == [(0, 5 * NS), (round(10.1 * NS), round(10.1 * NS))]
    assert split_at_gaps(np.empty(0, dtype=np.int64), NS) == []


def test_going_there_and_back_is_two_passes_and_drifting_about_is_not():
    t = ramp(0, 60)
    s = t / NS
    there_and_back = np.where(s < 30, 0.4 * s, 0.4 * (60 - s))
    turns = reversals(t, there_and_back, 1.0)
    assert len(turns) == 1
    assert turns[0] / NS == pytest.approx(30, abs=0.2)
    assert reversals(t, 0.4 * np.sin(s), 1.0) == []  # swinging by less than a metre
    assert reversals(t, 0.4 * s + 0.4 * np.sin(s), 1.0) == []  # surging, but never back by a metre


def test_several_turns_alternate():
    t = ramp(0, 100)
    turns = reversals(t, 5 * np.sin(2 * np.pi * t / NS / 40), 1.0)
    np.testing.assert_allclose(np.array(turns) / NS, [10, 30, 50, 70, 90], atol=0.3)


def test_passes_are_where_both_instruments_run():
    ins = np.concatenate([ramp(0, 40), ramp(60, 100)])
    pings = np.concatenate([ramp(5, 20, 10), ramp(27, 70, 10), ramp(90, 120, 10)])
    passes = find_passes(ins, ins / NS * 0.4, pings, 5 * NS, 1.0)
    expected = [(5, 20), (27, 40), (60, 70), (90, 100)]
    np.testing.assert_allclose(np.array(passes) / NS, expected, atol=0.11)


def test_a_gap_of_five_seconds_is_none():
    ins = np.concatenate([ramp(0, 10), ramp(14.9, 25)])
    assert len(find_passes(ins, ins / NS, ramp(0, 25, 10), 5 * NS, 1.0)) == 1


def test_moments_are_given_their_pass():
    starts, ends = seconds(0, 10), seconds(5, 15)
    assert pass_of(seconds(-1, 0, 5, 6, 10, 15, 16), starts, ends).tolist() == [-1, 0, 0, -1, 1, 1, -1]
    assert pass_of(seconds(1), np.empty(0, np.int64), np.empty(0, np.int64)).tolist() == [-1]


@pytest.mark.parametrize("azimuth_deg", [0.0, 47.0, -163.0, 90.0])
def test_the_track_is_taken_where_the_target_lies_to_starboard(azimuth_deg):
    a = np.radians(azimuth_deg)
    along = np.linspace(-8, 8, 200)
    forward, starboard = np.array([np.sin(a), np.cos(a)]), np.array([np.cos(a), -np.sin(a)])
    there = np.outer(along, forward) - 5 * starboard  # target 5 m to starboard
    back = np.outer(-along, forward) - 6 * starboard  # coming back: to port
    heading = np.concatenate([np.full(200, a), np.full(200, a + np.pi)])
    east, north = np.concatenate([there, back]).T
    estimate = estimate_azimuth(east, north, heading)
    assert np.degrees(np.angle(np.exp(1j * (estimate - a)))) == pytest.approx(0, abs=1e-9)
    port_alone = estimate_azimuth(east[200:], north[200:], heading[200:])  # its heading is the other way
    assert np.degrees(np.angle(np.exp(1j * (port_alone - a)))) == pytest.approx(0, abs=1e-9)
    assert estimate_azimuth(east - 100 * starboard[0], north - 100 * starboard[1], heading) is None
