"""``poolcal coarse``: mounts found, what is printed of them, and residuals."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline.config.load import load_session
from tests.support.marks import KEYS, PLAIN, marks_of, mounts_in, run
from tests.support.roots import CONFIGS
from tests.support.surveys import BY_AXES, ON_BODY, SHARED, World

EXAMPLE = CONFIGS / "marks.yaml"
FORWARD = {"axes": {"origin": "O", "forward": ["A1", "A2"], "roll_deg": 1.7}}
STARBOARD = {"axes": {"origin": "O", "starboard": ["S1", "S2"], "pitch_deg": -2.3}}


@pytest.mark.parametrize(
    ("world", "body"), [(SHARED, {}), (BY_AXES, FORWARD), (BY_AXES, STARBOARD)], ids=["marks", "forward", "starboard"]
)
def test_session_yaml_gets_the_true_mounts(world: World, body: dict[str, Any], session: Path) -> None:
    """From a survey without errors, to the last digit written; signs are those of an independent forward model."""
    told = run(session, marks_of(world, None) | ({"body": body} if body else {}))
    assert told.status == 0, told.err
    for name, found in mounts_in(session).items():
        np.testing.assert_allclose(found, world.mounts[name], atol=3e-6 if not body else 6e-4)
    content = load_session(session)
    assert content.laser.mount_origin is not None
    assert content.laser.mount_origin.method == "coarse"
    assert content.laser.mount_origin.file == "marks.yaml"
    assert np.array(content.mbes.mount_covariance).shape == (6, 6)


def test_the_example_solves(session: Path) -> None:
    told = run(session, EXAMPLE)
    assert told.status == 0, told.err
    found = mounts_in(session)
    np.testing.assert_allclose(found["laser"], (0.35, -0.22, 0.41, 0.21, 0.48, 1.10), atol=1.2)
    np.testing.assert_allclose(found["mbes"], (-48.8, 1.2, -2.0, 0.30, 0.20, -2.01), atol=1.2)
    text = EXAMPLE.read_text(encoding="utf-8")
    for key in ("survey", "marks", "body", "axes", "laser", "mbes", "leave_out", "roll_sigma_deg", "pitch_sigma_deg"):
        assert f"{key}:" in text


def test_the_example_solves_by_axes_too(session: Path) -> None:
    text = EXAMPLE.read_text(encoding="utf-8")
    body = re.search(r"^body:.*?(?=^laser:)", text, re.M | re.S)
    assert body is not None
    for line in re.findall(r"# (axes: \{.*?\})", body[0]):
        file = session.parent / "axes.yaml"
        file.write_text(text.replace(body[0], f"body:\n  {line}\n\n"), encoding="utf-8")
        told = run(session, file, "--no-write")
        assert told.status == 0, told.err


def test_screen_and_yaml_say_the_same(session: Path, tmp_path: Path) -> None:
    out = tmp_path / "found.yaml"
    told = run(session, marks_of(SHARED), "--yaml", out, "--no-write")
    assert told.status == 0, told.err
    assert (session / "session.yaml").read_text(encoding="utf-8") == PLAIN
    assert "not written (--no-write)" in told.out
    found = yaml.safe_load(out.read_text(encoding="utf-8"))
    assert found["agrees"] is True
    assert found["global_test"]["degrees_of_freedom"] == 3 * 16 - 18
    assert f"limit {found['global_test']['limit']:.1f}, 30 degrees of freedom: passed" in told.out
    for name in ("laser", "mbes"):
        block = found["mounts"][name]
        truth = dict(zip(KEYS, SHARED.mounts[name], strict=True))
        for key in KEYS:
            assert abs(block["mount"][key] - truth[key]) < 4 * block["sigma_mount"][key]
            assert f"{block['mount'][key]:.4f}" in told.out
            assert f"{block['sigma_mount'][key]:.4f}" in told.out
    assert found["mounts"]["mbes"]["change"]["y_m"] == pytest.approx(found["mounts"]["mbes"]["mount"]["y_m"] - 0.12)
    assert len(found["residuals"]) == 16
    assert "B1" in told.out
    assert run(session, marks_of(SHARED), "--yaml", out, "--no-write").status == 0  # its own file is replaced
    mine = session.parent / "marks.yaml"
    for there, words in ((mine, "did not write it"), (session / "a.yaml", "lies in the folder")):
        refused = run(session, marks_of(SHARED), "--yaml", there)
        assert refused.status == 2
        assert words in refused.err


def test_residuals_are_in_body_axes(session: Path, tmp_path: Path) -> None:
    """A mark of little weight, measured 20 mm too far forward on a boat that heads elsewhere, lies off in y."""
    marks, out = marks_of(World(), None), tmp_path / "found.yaml"
    level = np.array(marks["survey"]["marks"]["B1"])
    world = World()
    world.frames = {**world.frames, "body": {**ON_BODY, "B1": (0.35, 0.77, 0.20)}}
    moved = np.array(world.survey()["B1"])
    assert abs(moved - level).max() > 0.01
    marks["survey"]["marks"]["B1"] = {"at": moved.tolist(), "sigma_m": 0.2}
    assert run(session, marks, "--yaml", out, "--no-write").status == 0
    rows = {row["mark"]: row for row in yaml.safe_load(out.read_text(encoding="utf-8"))["residuals"]}
    np.testing.assert_allclose(rows["B1"]["residual_body_mm"], [0.0, 20.0, 0.0], atol=0.1)
