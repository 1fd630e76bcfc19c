"""The parts of a session."""

import pandas as pd

from pipeline.adjustment.parts import parts_of


def passes(*distances_m: float) -> pd.DataFrame:
    numbers = range(len(distances_m))
    return pd.DataFrame(
        {"pass": numbers, "start_ns": [100 * number for number in numbers], "distance_m": distances_m}
    )


def test_parts_by_pass_time_and_distance() -> None:
    parts = {part.name: part.passes for part in parts_of(passes(4.0, 8.0, 5.0, 7.0))}
    assert parts == {
        "without pass 0": (1, 2, 3),
        "without pass 1": (0, 2, 3),
        "without pass 2": (0, 1, 3),
        "without pass 3": (0, 1, 2),
        "first half": (0, 1),
        "second half": (2, 3),
        "near passes": (0, 2),
        "far passes": (3, 1),
    }


def test_a_port_side_target_has_negative_distances() -> None:
    assert {part.name: part.passes for part in parts_of(passes(-4.0, -8.0))}["far passes"] == (1,)


def test_without_another_pass_or_distance_there_are_fewer_parts() -> None:
    assert parts_of(passes(5.0)) == []
    assert [part.name for part in parts_of(passes(6.0, 6.4))] == [
        "without pass 0", "without pass 1", "first half", "second half",
    ]  # fmt: skip
    assert {part.name for part in parts_of(passes(6.0, 6.6))} >= {"near passes", "far passes"}
