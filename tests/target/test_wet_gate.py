"""The gate of the soundings where wet faces may stand off the dry ones."""

import numpy as np
import pytest

from pipeline.config.stage_settings import FacesAsBuilt
from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.outlines import Outline, build_target
from pipeline.target.gate import SHARE_OF_PERIOD, for_uncertain_faces
from pipeline.target.search_results import ProvisionalMount

WALL = Outline("wall", [(0, 2, -4), (0, -2, -4), (0, -2, 2), (0, 2, 2)])
SCALE_M = 0.01


def mount(gate_m: float = 0.05, scale_m: float = SCALE_M) -> ProvisionalMount:
    return ProvisionalMount(
        rotation_vector_rad=np.zeros(3), lever_arm_correction_m=np.zeros(3), scale_m=scale_m, gate_m=gate_m,
        score=1.0, rival_score=0.0, ambiguous=False, within=True,
    )  # fmt: skip


def as_built(offset_m: float, angle_deg: float, growth_m: float = 0.0) -> FacesAsBuilt:
    return FacesAsBuilt(faces={}, offset_sigma_m=offset_m, angle_sigma_deg=angle_deg, growth_sigma_m=growth_m)


def model(repeats_m: float | None = None) -> TargetModel:
    return build_target([WALL], [], 0.0, repeats_m)


def test_a_surveyed_target_keeps_its_gate() -> None:
    assert for_uncertain_faces(mount(), as_built(0.001, 0.01), model()).gate_m == 0.05


@pytest.mark.parametrize(
    ("offset_m", "angle_deg", "growth_m"), [(0.02, 0.0, 0.0), (0.0, 1.0, 0.0), (0.02, 0.1, 0.0), (0.01, 0.1, 0.03)]
)
def test_a_wall_that_nobody_has_surveyed_widens_it(offset_m: float, angle_deg: float, growth_m: float) -> None:
    """4 sigmas of its place, of growth on it, of its lean over half of its 4 m of depth, and of the noise."""
    expected = 4 * np.sqrt(offset_m**2 + growth_m**2 + (np.radians(angle_deg) * 2.0) ** 2 + SCALE_M**2)
    found = for_uncertain_faces(mount(), as_built(offset_m, angle_deg, growth_m), model())
    assert found.gate_m == pytest.approx(expected)


def test_a_wider_gate_stays_and_a_repeating_target_bounds_it() -> None:
    assert for_uncertain_faces(mount(0.3), as_built(0.02, 0.1), model()).gate_m == 0.3
    assert for_uncertain_faces(mount(), as_built(0.1, 1.0), model(0.4)).gate_m == pytest.approx(SHARE_OF_PERIOD * 0.2)


def test_without_a_mount_there_is_no_gate_to_widen() -> None:
    assert for_uncertain_faces(mount(scale_m=np.inf), as_built(0.02, 0.1), model()).gate_m == 0.05
