"""poolcal patch: angles from passes over the bottom alone, what they do not show, and a run that agrees or does not."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.artefacts.streams import Stream, serial
from pipeline.atomic_files import read_json
from pipeline.config.load import load_session
from pipeline.config.stage_settings import SonarPlacement, narrow
from pipeline.maths.geometry.rotations import log_so3, mount_from_rotation
from pipeline.mount import mount_of
from pipeline.patch_test.passes import read_passes
from pipeline.patch_test.solve import HeadBefore, patch_test
from pipeline.readers.casts import with_cast
from pipeline.readers.dispatch import raw_parts
from tests.support.docks import of_faces
from tests.support.places import Place, Told, edit, poolcal, simulate

NAMES = ("roll", "pitch", "yaw")
ROW = re.compile(r"^ +(roll|pitch|yaw) ° +(\S+) +(not seen|\S+) *(\S*) *(\S*) *(\S*)$", re.MULTILINE)


def bottom(north_m: float) -> dict[str, Any]:
    """A target of a level bottom and one that rises to the north, heard both ways; a quay ashore keeps the laser busy.

    The small scenario's head looks to starboard, so each square is heard from its one side, then from the other.
    """
    faces = {
        "level": {"corners": [[-13, -7, -6], [-1, -7, -6], [-1, 0, -6], [-13, 0, -6]], "seen": "wet"},
        "slope": {"corners": [[-13, 0, -6], [-1, 0, -6], [-1, 7, north_m], [-13, 7, north_m]], "seen": "wet"},
        "quay": {"corners": [[6, 6, 0.3], [6, -6, 0.3], [6, -6, 2], [6, 6, 2]], "seen": "dry"},
    }
    return of_faces(faces, azimuth_deg=163.0) | {
        "track": {
            "distances_m": [12.0, 3.0, 10.0, 5.0], "courses": ["along", "back"], "half_length_m": 9.0, "speed_m_s": 1.2,
        },
        "laser": {"point_rate_hz": 500.0, "line_rate_hz": 20.0, "format": "las"},
    }  # fmt: skip


def patched(session: Path, *words: object) -> Told:
    return poolcal("patch", session, "--jobs", 1, *words)


def rows(told: Told) -> dict[str, list[str]]:
    return {name: list(cells) for name, *cells in ROW.findall(told.out)}


def true_angles_deg(session: Path) -> np.ndarray:
    truth = read_json(Path(f"{session}.truth.json"))["mbes"]
    return np.degrees(mount_from_rotation(np.array(truth["R_body_from_mbes"])))


@pytest.fixture(scope="module")
def sloping(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session over a slope of 20°; its coarse angles are wrong by 2.5°."""
    coarse = {"roll_deg": 2.5, "pitch_deg": -2.5, "yaw_deg": 2.5, "x_m": 0.02, "y_m": -0.02, "z_m": 0.02}
    folder = tmp_path_factory.mktemp("patch") / "session"
    return simulate(folder, 5, **bottom(-3.5), mbes={"coarse_error": coarse})


def test_angles_come_from_the_bottom_alone(sloping: Path) -> None:
    told = patched(sloping)
    assert told.status == 0, told.err
    found = rows(told)
    assert tuple(found) == NAMES
    values, sigmas = (np.array([float(found[name][k]) for name in NAMES]) for k in (1, 2))
    assert np.abs((values - true_angles_deg(sloping)) / sigmas).max() < 4
    assert sigmas[0] < 0.03
    assert sigmas[1:].max() < 0.3  # of a lever arm of 5 cm at some metres
    assert np.abs(values - [float(found[name][0]) for name in NAMES]).min() > 1.5  # of the coarse angles
    assert "The lever arm is not seen by such passes: x, y, z stay as they are, and the angles belong" in told.out
    assert told.out.startswith("Patch test of 4 passes, of 4 that were sailed: ")
    assert re.search(r"^Refused: \w.*: \d+", told.out, re.MULTILINE)


def test_the_same_files_give_the_same_text_with_two_workers(sloping: Path) -> None:
    assert poolcal("patch", sloping, "--jobs", 2).out == patched(sloping).out


def test_a_run_agrees_and_a_head_that_was_turned_does_not(
    sloping: Path, undisturbed: tuple[Path, Told], tmp_path: Path
) -> None:
    run, _ = undisturbed
    told = patched(sloping, "--run", run)
    assert told.status == 0, told.out
    assert "run and the passes agree." in told.out
    assert all(float(cells[4]) < 3.3 for cells in rows(told).values())

    turned = simulate(
        tmp_path / "turned", 6, **bottom(-3.5), mbes={"mount": {
            "roll_deg": -48.4, "pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.30, "y_m": 0.20, "z_m": -2.01}}
    )  # fmt: skip
    told = patched(turned, "--run", run)
    assert told.status == 1, told.out
    assert "run and the passes do not agree: do not enter these angles before you know why." in told.out
    assert float(rows(told)["roll"][3]) == pytest.approx(0.4, abs=0.05)  # by how much, and its sign


def test_passes_one_way_at_one_distance_do_not_show_roll(tmp_path: Path) -> None:
    blocks = bottom(-6.0)
    blocks["track"] |= {"distances_m": [12.0, 12.0, 12.0], "courses": ["along"]}
    told = patched(simulate(tmp_path / "session", 7, **blocks))
    assert told.status == 0, told.err
    assert "not seen" in rows(told)["roll"][1]
    assert "Roll is not seen: sail both ways over the same bottom." in told.out
    assert "Yaw is not seen: sail over a slope" in told.out


def test_a_wrong_sound_speed_is_named_and_its_angles_are_in_doubt(tmp_path: Path) -> None:
    """One per cent turns roll by a third of a degree, twenty of its sigmas: nothing of that may look right."""
    session = simulate(tmp_path / "session", 8, **bottom(-3.5), mbes={"sound_speed_true_m_s": 1485.0})
    told = patched(session)
    said = " ".join(told.out.split())
    assert told.status == 1, told.out
    assert re.search(r"The soundings contradict session.yaml: the sound speed: it is -(0.9\d*|1.0\d*) ± 0.\d+ % ", said)
    assert "Do not use these angles before that is mended." in said


def test_heights_that_jump_between_passes_are_seen(tmp_path: Path) -> None:
    """Heights off by 15 cm, where session.yaml says 2 cm: the squares on which the passes differ are counted."""
    session = simulate(tmp_path / "session", 9, **bottom(-3.5), ins={"drift": {
        "horizontal_m": 0.015, "vertical_m": 0.15, "roll_pitch_deg": 0.01, "heading_deg": 0.03,
        "time_constant_s": 60.0}})  # fmt: skip
    edit(session / "session.yaml", "ins", drift={"vertical_m": 0.02, "time_constant_s": 200.0})
    told = patched(session)
    assert told.status in (1, 2), told.out
    said = " ".join((told.out + told.err).split())
    assert re.search("of the flat squares the passes differ by too much|heights differ between passes", said)


def test_the_angles_belong_to_the_lever_arm_as_it_is_known(sloping: Path) -> None:
    """They are those of an adjustment whose lever arm is known exactly; its sigmas come on top."""
    session = load_session(sloping, with_cast)
    ins, mbes = (Stream(raw_parts(name, getattr(session, name), sloping)) for name in ("ins", "mbes"))
    passes = read_passes(ins, mbes, session, narrow(SonarPlacement, session.sonar), None)
    loose = HeadBefore.of(session, session.sonar)
    exact = replace(loose, known=np.diag([*np.diag(loose.known)[:3], 1e-12, 1e-12, 1e-12]))
    found, expected = (patch_test(passes, head, serial) for head in (loose, exact))
    sigma = np.sqrt(np.diag(expected.covariance))[:3]
    apart = log_so3(found.mount.R_body_from_sensor @ expected.mount.R_body_from_sensor.T)
    assert np.abs(apart / sigma).max() < 0.5
    np.testing.assert_allclose(found.mount.lever_arm_body_m, mount_of(session.sonar.mount).lever_arm_body_m)
    by_arm = np.sqrt(np.diag(found.covariance - expected.covariance)[:3])
    assert 0.7 < by_arm[0] / (0.02 / 5.0) < 1.4  # pitch: of 2 cm forward, at 4 to 6 m


def test_refusals_say_what_to_do(sloping: Path, tmp_path: Path) -> None:
    cast = tmp_path / "cast"
    shutil.copytree(sloping, cast)
    edit(cast / "session.yaml", "mbes", svp=[[0.0, 1500.0], [10.0, 1501.0]])
    told = patched(cast)
    assert told.status == 2
    assert told.err.startswith("poolcal: --water-height: is missing: mbes.svp counts depths from the water; ")
    told = patched(cast, "--water-height", 12.0)
    assert told.status == 0, told.err
    for height, where in (("6", "below"), ("60", "above"), ("nan", "above")):
        told = patched(cast, "--water-height", height)
        assert told.status == 2
        assert re.match(f"poolcal: --water-height {height}: lies .* m {where} the sonar; give the height", told.err)

    none = tmp_path / "none"
    shutil.copytree(sloping, none)
    edit(none / "session.yaml", "mbes", mount={"roll_deg": 48.0})
    told = patched(none)
    assert told.status == 2
    assert len(told.err.splitlines()) == 1
    assert re.match("poolcal: mbes: no square .* or mbes.mount.roll_deg has the wrong sign", told.err)


def test_a_rejected_run_is_not_compared(sloping: Path, done: Place) -> None:
    file = done.run / "report" / "calibration.json"
    content = json.loads(file.read_text("utf-8"))
    file.write_text(json.dumps(content | {"verdict": "rejected", "reason_codes": ["suspected_cause"]}), "utf-8")
    told = patched(sloping, "--run", done.run)
    assert told.status == 2
    assert "was rejected for suspected_cause: its lever arm" in told.err
