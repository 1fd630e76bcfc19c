"""docs/accuracy/real-laser-rows.md against the rows: its figures, and what the words between them say."""

import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.config.verdict import VerdictLimits
from pipeline.limits.verdict_limits import limits_by_setting, limits_of
from tests.support.roots import ROOT
from tools.libac_closing import GROUPS, PLANE, SPHERES
from tools.libac_page import PAGE, with_figures
from tools.libac_results import Results, results_of
from tools.libac_rows import PASSES, TARGETS, file_of
from tools.libac_surfaces import planes_in

NUMBER = re.compile(r"-?\d+(?:\.(\d+))?")


@pytest.fixture(scope="module")
def found(data: Path) -> Results:
    for target in TARGETS:
        for number in PASSES:
            if not file_of(data, number, target).is_file():
                pytest.skip(f"no rows of LibAC: {file_of(data, number, target)} is absent")
    return results_of(data)


def test_figures_of_the_page(found: Results) -> None:
    """Each figure is the data's, to one unit of its last digit."""
    page = (ROOT / PAGE).read_text(encoding="utf-8")
    made = with_figures(page, found)
    assert NUMBER.sub("#", page) == NUMBER.sub("#", made), "run python -m tools.libac_page"
    for stated, true in zip(NUMBER.finditer(page), NUMBER.finditer(made), strict=True):
        unit = 10.0 ** -len(true[1] or "")
        assert abs(float(stated[0]) - float(true[0])) < 1.001 * unit, (stated[0], true[0])


def test_frames_and_signs(found: Results) -> None:
    assert found.placed_apart_m < 1e-9
    assert min(found.reversed_m.values()) > 0.5


def test_the_plane_is_on_the_target_alone(found: Results) -> None:
    for (target, number), planes in found.planes.items():
        assert len(planes) == (target == PLANE), (target, number)
    for number in PASSES:
        (plane,) = found.planes[PLANE, number]
        assert plane.plane.rms_m < 0.0015
        assert len(plane.rows) > 0.9 * len(found.rows[PLANE, number])


def test_a_step_of_a_centimetre_is_no_plane(found: Results) -> None:
    """The limits are narrow enough to tell: half of the target moved by a centimetre is not taken in."""
    rows = found.rows[PLANE, 2]
    (whole,) = found.planes[PLANE, 2]
    points = rows.in_level(found.cases[0].coarse)
    points[: len(rows) // 2] += 0.01 * whole.plane.normal
    assert max((len(one.rows) for one in planes_in(points, rows.position_m[0])), default=0) < 0.7 * len(rows)


def test_normals_differ_about_the_vertical(found: Results) -> None:
    for case in found.cases:
        for plane in (case.before.plane, case.after.plane):
            assert 7.5 < plane.angle_deg / plane.angle_sigma_deg < 8.5
            assert np.sqrt(plane.angle_deg**2 - plane.lean_deg**2) == pytest.approx(5.4, abs=0.15)
    assert abs(found.cases[0].after.plane.lean_deg) < abs(found.cases[0].before.plane.lean_deg) / 3


def test_one_sphere_is_a_sphere_and_the_other_is_not(found: Results) -> None:
    radii = {name: [found.spheres[name, number].radius_m for number in PASSES] for name in SPHERES}
    assert radii["sphere2"] == pytest.approx([0.1, 0.1], abs=0.01)
    assert radii["sphere1"][1] > 2 * radii["sphere1"][0]
    assert min(found.spheres["sphere1", number].rms_m for number in PASSES) > 0.004


def test_the_spheres_contradict_the_adjusted_mounts(found: Results) -> None:
    own, script = found.cases
    for name in SPHERES:
        assert np.abs(own.before.of_sphere(name)[1:]).max() < 0.022
        assert abs(own.before.of_sphere(name)[2]) < abs(own.explanation.up_by_roll_m)  # 0.1°
        assert own.after.of_sphere(name)[2] < -0.1
        assert script.after.of_sphere(name)[2] < -0.1
        assert script.before.of_sphere(name)[2] == pytest.approx(-5 * script.explanation.up_by_roll_m, rel=0.1)
    assert abs(own.after.plane.distance_m) < abs(own.before.plane.distance_m) / 3
    assert abs(script.after.plane.distance_m) < abs(script.before.plane.distance_m) / 3


def test_heights_tell_of_roll_alone(found: Results) -> None:
    case = found.cases[0]
    by_sigma = np.abs(case.explanation.design[list(GROUPS["up"])]) * np.sqrt(np.diag(case.adjusted.coarse))
    assert by_sigma[:, 1].min() > 0.19
    assert np.delete(by_sigma, 1, axis=1).max() < 0.01


def test_along_the_track_nothing_explains_the_spheres(found: Results) -> None:
    for case in found.cases:
        along = [case.before.of_sphere(name)[0] for name in SPHERES]
        assert along[0] > 0.18
        assert along[1] < -0.18
        assert case.explanation.squares(GROUPS["along"]) > 100
        for name in ("plane", "across", "up"):
            assert case.explanation.squares(GROUPS[name]) < 2


def test_two_directions_of_six_and_no_verdict(found: Results) -> None:
    limits = limits_by_setting(limits_of(VerdictLimits(), "laser"))
    for case in found.cases:
        assert case.adjusted.result.converged
        assert np.all(case.adjusted.shares[:2] < 0.5)
        assert np.all(case.adjusted.shares[2:] > 0.99)
        sigmas = case.adjusted.mount.sigmas(case.adjusted.covariance)
        assert all(sigma > 1.5 * limits[name] for name, sigma in sigmas.items())
    assert min(found.roll_sigmas) > 2
