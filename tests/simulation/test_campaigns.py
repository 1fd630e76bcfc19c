"""The systematic errors that a campaign of pairs draws: whose they are, and how large."""

from typing import Any

import numpy as np

from pipeline.config.mount import MountSigma
from pipeline.config.yaml_models import parse
from pipeline.maths.mount_parameters import SETTINGS
from pipeline.simulation.scenario import Scenario
from tools.campaigns import CAMPAIGNS, scenario_of
from tools.drawn_errors import errors_of_pairs

(PAIRS,) = (campaign for campaign in CAMPAIGNS if campaign.drawn is errors_of_pairs)


def scenarios(count: int) -> list[Scenario]:
    return [parse(Scenario, scenario_of(PAIRS, number), PAIRS.name) for number in range(count)]


OWN = {
    "mbes": {
        "sound_speed_true_m_s": 0.2, "head_speed_excess": 0.2 / 1500, "sound_speed_gradient_1_s": 0.1,
        "latency_s": 0.0005, "incidence_bias_m": 0.003, "level_bias_m": 0.010,
    },
    "laser": {"latency_s": 0.0002, "incidence_bias_m": 0.001},
}  # fmt: skip


def test_a_pair_shares_what_belongs_to_its_devices_and_nothing_else() -> None:
    first, second, third = scenarios(3)
    assert first.laser.coarse_error is not None
    assert first.laser.coarse_error == second.laser.coarse_error != third.laser.coarse_error
    for name in ("range_bias_m", "projector_offset_m"):
        assert getattr(first.mbes, name) == getattr(second.mbes, name) != getattr(third.mbes, name)
    for sensor, names in OWN.items():
        for name in names:
            assert len({getattr(getattr(one, sensor), name) for one in (first, second, third)}) == 3
    assert all(one.mbes.sound_speed_recorded_m_s == 1500.0 for one in (first, second, third))
    assert not first.mbes.give_projector_offset


def test_the_errors_are_as_large_as_the_sessions_say() -> None:
    """Nothing in session.yaml says otherwise than the defaults, which are these."""
    drawn: list[dict[str, Any]] = [errors_of_pairs(seed) for seed in range(0, 2000, 2)]
    of_mount = MountSigma()
    for sensor, sizes in OWN.items():
        for name, sigma in sizes.items():
            values = np.array([one[sensor][name] for one in drawn])
            values -= 1500.0 if name == "sound_speed_true_m_s" else 0.0
            assert 0.9 < values.std() / sigma < 1.1
            assert abs(values.mean()) < 4 * sigma / np.sqrt(len(values))
    assert 0.9 < np.std([one["mbes"]["range_bias_m"] for one in drawn]) / 0.005 < 1.1
    assert 0.9 < np.std([one["mbes"]["projector_offset_m"] for one in drawn]) / 0.005 < 1.1
    for key in SETTINGS:
        sigma = of_mount.angle_deg if key.endswith("_deg") else of_mount.lever_arm_m
        assert 0.9 < np.std([one["laser"]["coarse_error"][key] for one in drawn]) / sigma < 1.1
