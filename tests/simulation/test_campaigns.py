"""The errors that campaigns draw: whose they are, and how large; and mirror images of sessions."""

from typing import Any

import numpy as np
import pytest

from pipeline.config.mount import MountSigma
from pipeline.config.pool import AsBuilt
from pipeline.config.yaml_models import parse
from pipeline.maths.mount_parameters import SETTINGS
from pipeline.simulation.mesh import build_mesh
from pipeline.simulation.relief import Relief
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.scenario_surroundings import Surroundings
from pipeline.target.design import target_of
from tools.campaigns import CAMPAIGNS, scenario_of
from tools.drawn_errors import errors_of_pairs, face_faults
from tools.mirrored import mirrored
from tools.stress_campaigns import ALL

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


def test_no_two_campaigns_share_a_seed() -> None:
    seeds = [seed for one in ALL for seed in range(one.first_seed, one.first_seed + one.sessions)]
    assert len(set(seeds)) == len(seeds)


@pytest.mark.parametrize("family", ["P1", "P2", "P3", "H"])
def test_wet_faces_of_a_family_turn_as_one_rigid_body(family: str) -> None:
    """Tops and bottoms have opposite normals, and move together upward."""
    scenario = parse(Scenario, {"name": "faces"}, "faces")
    mesh, sizes = build_mesh(scenario.target, scenario.surroundings), []
    random = np.random.default_rng(1)
    for seed in range(40):
        sigmas = AsBuilt(face_sigma_m=0.0, bow_sigma_m=0.0)
        faults = list(face_faults(target_of(scenario.target), np.random.default_rng(seed), sigmas))
        relief = Relief(scenario.target, parse(Surroundings, {"face_faults": faults}, "faults"), mesh, 1)
        level = np.char.endswith(relief.faces, ("-top")) | np.char.endswith(relief.faces, "-bottom")
        of_family = level if family == "H" else np.char.startswith(relief.faces, family) & ~level
        triangles = np.repeat(np.flatnonzero(of_family), 20)
        corners = mesh.vertices_m[mesh.triangles[triangles]]
        points = np.einsum("nk,nkx->nx", random.dirichlet([1.0, 1.0, 1.0], len(triangles)), corners)
        wet = points[:, 2] < scenario.target.water_level_m - 1e-9
        triangles, points = triangles[wet], points[wet]
        normal = np.array([0.0, 0.0, 1.0]) if family == "H" else mesh.normals[triangles[0]]
        first = np.array([1.0, 0.0, 0.0] if family == "H" else [0.0, 0.0, 1.0])
        second = np.cross(normal, first)
        moved = relief.heights_m(triangles, points) * (mesh.normals[triangles] @ normal)
        design = np.column_stack([np.ones(len(points)), points @ first, points @ second])
        found, *_ = np.linalg.lstsq(design, moved, rcond=None)
        np.testing.assert_allclose(design @ found, moved, atol=1e-12)
        sizes.append(np.degrees(found[1:]))
    assert np.std(sizes, axis=0) == pytest.approx([0.01, 0.01], rel=0.35)


def test_each_face_stands_out_by_its_own_error() -> None:
    target = target_of(parse(Scenario, {"name": "faces"}, "faces").target)
    drawn = [list(face_faults(target, np.random.default_rng(seed))) for seed in range(300)]
    own = np.array([[fault["shift_m"] for fault in one if "part" not in fault] for one in drawn])
    assert own.shape == (300, len(target.faces))
    assert own.std(axis=0) == pytest.approx(np.full(len(target.faces), 0.0005), rel=0.25)
    bows = [fault["bow_m"] for one in drawn for fault in one if "bow_m" in fault]
    assert len(bows) == 3 * len(drawn)
    assert np.std(bows) == pytest.approx(0.001, rel=0.1)


def test_a_mirror_image_has_the_opposite_errors_and_the_same_times() -> None:
    exact = {"t_ns": np.arange(10, 50, 10), "beam": np.array([1, 2, 1, 2]), "angle_rad": np.arange(4.0)}
    noisy = {"t_ns": np.array([40, 10, 70]), "beam": np.array([2, 1, 2]), "angle_rad": np.array([3.5, -0.25, 9.0])}
    kept, image = mirrored(noisy, exact)
    assert kept["t_ns"].tolist() == image["t_ns"].tolist() == [40, 10]  # the third has no record without noise
    assert kept["angle_rad"].tolist() == [3.5, -0.25]
    assert image["angle_rad"].tolist() == [2.5, 0.25]
