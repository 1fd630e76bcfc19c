"""Where a run's figures come from: the files' own keys, a preset, the INS's files, or nobody."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pipeline.config.instruments import PRESETS
from pipeline.config.load import load_pool, stated_keys
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_file import read_yaml
from pipeline.results.pages.assumptions import assumed_groups, drift_note
from pipeline.results.pages.instrument_table import instrument_rows
from pipeline.results.pages.rendering import render_page
from pipeline.run.origins import is_recorded, origin_of
from pipeline.run.settings import Settings, read_settings, write_settings
from tests.support.pages import Page
from tests.support.preset_sessions import FOREIGN, MOUNT, session

SIGMAS = ("horizontal_m", "vertical_m", "roll_pitch_deg", "heading_deg")


def _settings(folder: Path, found: SessionConfig) -> Settings:
    """The session with the demo's pool, as poolcal run has them: with the keys that the files state."""
    pool = PRESETS.parent / "defaults.yaml"
    stated = {"session": stated_keys(read_yaml(folder / "session.yaml")), "config": stated_keys(read_yaml(pool))}
    return Settings(folder, load_pool(pool), found, {}, stated)


def _shown(settings: Settings, from_files: tuple[str, ...] = ()) -> list[list[str]]:
    drift = settings.session.ins.drift.model_dump() | {"from_files": list(from_files)}
    html = render_page("instrument_table.html", figures=instrument_rows(settings, drift))
    assert "<b>\"O'Brien" not in html
    return Page(html).table("sensor", "instrument", "figure")


def test_the_report_says_which_figure_comes_from_where(tmp_path: Path) -> None:
    """A value in session.yaml is the session's, be it the default or not, with a preset or without one."""
    preset = {
        "title": FOREIGN,
        "sensor": "mbes",
        "settings": {"range_sigma_m": 0.02, "angle_sigma_deg": 0.07, "beam_deg": [0.4, 1.5]},
        "unverified": ["range_sigma_m", "angle_sigma_deg"],
    }
    mbes = {"instrument": "mine", "angle_sigma_deg": 0.06, "latency_sigma_s": 0.0005}  # 0.0005: as the default
    laser = {"range_sigma_m": 0.005}  # as the default
    found = session(tmp_path, {"mine": preset}, mbes=mbes, laser=laser, ins={"white": {"position_m": 0.002}})
    shown = _shown(_settings(tmp_path, found))
    assert [row[:2] for row in shown if row[0]] == [["ins", "–"], ["laser", "–"], ["mbes", FOREIGN], ["target", "–"]]
    told: dict[str, dict[str, tuple[str, str]]] = {}
    for sensor, _, key, value, origin in shown:
        told.setdefault(sensor or [*told][-1], {})[key] = (value, origin)
    assert told["ins"]["drift.horizontal_m"] == ("0.015", "default")
    assert told["ins"]["drift_within.time_constant"] == ("3", "default")
    assert told["ins"]["white.position_m"] == ("0.002", "session")
    assert told["ins"]["white.attitude_deg"] == ("0.002", "default")
    assert told["laser"]["range_sigma_m"] == ("0.005", "session")
    assert told["laser"]["angle_sigma_deg"] == ("0.003", "default")
    assert told["laser"]["mount_sigma.angle_deg"] == ("0.005", "default")
    assert told["laser"]["latency_sigma_s"] == ("0.0002", "default")
    assert told["mbes"]["range_sigma_m"] == ("0.02", "preset (mine), unverified")
    assert told["mbes"]["angle_sigma_deg"] == ("0.06", "session")
    assert told["mbes"]["beam_deg"] == ("0.4, 1.5", "preset (mine)")
    assert told["mbes"]["focused"] == ("yes, no", "default")
    assert told["mbes"]["sound_speed_gradient_sigma_1_s"] == ("0.1", "default")
    assert told["mbes"]["latency_sigma_s"] == ("0.0005", "session")
    assert "svp_sigma_m_s" not in told["mbes"]  # without a cast it has no part
    assert told["target"]["as_built.face_sigma_m"][0] == "0.0005"


def test_sigmas_of_the_ins_s_files_are_told_to_be_theirs(tmp_path: Path) -> None:
    shown = _shown(_settings(tmp_path, session(tmp_path)), ("horizontal_m",))
    origins = {row[2]: row[4] for row in shown}
    assert (origins["drift.horizontal_m"], origins["drift.vertical_m"]) == ("the INS's files", "default")


def test_an_older_run_does_not_claim_to_know(tmp_path: Path) -> None:
    """Its run.yaml has no stated keys: a value that is the default may be the session's."""
    found = session(tmp_path, laser={"range_sigma_m": 0.006})
    older = replace(_settings(tmp_path, found), stated={})
    origins = {row[2]: row[4] for row in _shown(older)[9:]}
    assert origins["angle_sigma_deg"] == "default, or the same in the file"
    assert [row[4] for row in _shown(older) if row[3] == "0.006"] == ["session"]
    assert origin_of(older, "target.faces.quay.1.corners", changed=True) == "pool"  # names of faces may have dots
    assert list(assumed_groups(older, ())) == []
    assert not is_recorded(older)


def _said(groups: Iterable[Mapping[str, Any]]) -> str:
    return " | ".join(f"{group['words']} ({', '.join(group['figures'])})" for group in groups)


def test_the_certificate_names_what_nobody_stated(tmp_path: Path) -> None:
    groups = _said(assumed_groups(_settings(tmp_path, session(tmp_path)), ()))
    assert "slow errors of the INS (horizontal 15 mm, vertical 20 mm, roll and pitch 0.01°" in groups
    assert "the laser's own mount (angles 0.005°, lever arm 1.5 mm)" in groups
    assert "clocks (of the laser 0.2 ms, of the sonar 0.5 ms)" in groups
    assert "sound speed (0.2 m/s, 0.1 m/s per metre of depth)" in groups
    stated = {"mount_sigma": {"angle_deg": 0.005}, "latency_sigma_s": 0.0002}
    found = session(tmp_path, laser=stated, ins={"drift": {"heading_deg": 0.03}})
    groups = _said(assumed_groups(_settings(tmp_path, found), ()))
    assert "the laser's own mount (lever arm 1.5 mm)" in groups
    assert "clocks (of the sonar 0.5 ms)" in groups
    assert "heading" not in groups


def test_of_the_drift_each_figure_that_no_file_gave_is_named(tmp_path: Path) -> None:
    """An export may hold accuracies of positions alone."""
    plain = _settings(tmp_path, session(tmp_path))
    every = ("horizontal_m", "vertical_m", "roll_pitch_deg", "heading_deg")
    assert "slow errors of the INS (time constant 200 s)" in _said(assumed_groups(plain, every))
    assert "slow errors of the INS (roll and pitch 0.01°, heading 0.03°, time constant 200 s)" in (
        _said(assumed_groups(plain, every[:2]))
    )


def _of_laser(folder: Path, **laser: Any) -> Settings:
    """A session without a sonar, in a pool whose config states nothing."""
    settings = _settings(folder, session(folder, laser=laser).model_copy(update={"mbes": None}))
    return replace(settings, stated={**settings.stated, "config": ()})


def test_what_the_laser_s_own_calibration_assumes(tmp_path: Path) -> None:
    """Errors of single faces enter it; those of wet faces and of the laser's own mount do not."""
    settings = _of_laser(tmp_path)
    groups = _said(assumed_groups(settings, ()))
    assert "the coarse mount (angles 0.5°, lever arm 50 mm)" in groups
    assert "the target as built (single faces 0.5 mm, directions of its faces 0.02°" in groups
    assert "wet" not in groups
    assert "own mount" not in groups
    shown = {row[2]: row[3] for row in _shown(settings)}
    assert shown["as_built.face_sigma_m"] == "0.0005"
    assert "as_built.offset_sigma_m" not in shown


def test_the_covariance_that_poolcal_laser_wrote_is_none_of_the_coarse_mount(tmp_path: Path) -> None:
    covariance = [[1e-8 * (row == column) for column in range(6)] for row in range(6)]
    by_coarse = {"method": "coarse", "file": "marks.csv", "sha256": 64 * "0", "date": "2026-05-12"}
    by_coarse |= {"software": "poolcal"}
    by_laser = by_coarse | {"method": "fine", "mount": MOUNT}
    for origin, assumed in (
        (None, False),
        (by_coarse, False),
        (by_laser | {"coarse": {"mount": MOUNT, "covariance": None}}, True),
        (by_laser | {"coarse": {"mount": MOUNT, "covariance": covariance}}, False),
        (by_laser, True),  # of an older version: it counts for the values that were held alone
    ):
        stated: dict[str, Any] = {"mount_covariance": covariance} | ({"mount_origin": origin} if origin else {})
        groups = _said(assumed_groups(_of_laser(tmp_path, **stated), ()))
        assert ("the coarse mount" in groups) == assumed, origin


def test_the_certificate_names_what_the_ins_s_files_do_not_give(tmp_path: Path) -> None:
    """A log with an accuracy of the heading alone leaves the others to the program."""
    groups = _said(assumed_groups(_settings(tmp_path, session(tmp_path)), ("heading_deg",)))
    assert "INS (horizontal 15 mm, vertical 20 mm, roll and pitch 0.01°, time constant 200 s)" in groups


def test_the_note_on_the_drift_names_the_figures_that_nobody_stated(tmp_path: Path) -> None:
    plain = _settings(tmp_path, session(tmp_path))
    every = "horizontal 15 mm, vertical 20 mm, roll and pitch 0.01°, heading 0.03°, time constant 200 s"
    assert drift_note(plain, ()).endswith(f"nor the INS's log states them: {every}")
    assert drift_note(plain, SIGMAS) == ""  # but for the time constant
    assert drift_note(plain, SIGMAS[1:]).endswith("states them: horizontal 15 mm, time constant 200 s")
    assert drift_note(replace(plain, stated={}), ()) == ""
    whole = dict.fromkeys(SIGMAS, 0.02)
    assert drift_note(_settings(tmp_path, session(tmp_path, ins={"drift": whole})), ()) == ""


def test_a_part_of_the_drift_that_is_stated_does_not_silence_the_note(tmp_path: Path) -> None:
    """Stated in part, ins.drift goes before the log's accuracies, and the rest is the program's."""
    note = drift_note(_settings(tmp_path, session(tmp_path, ins={"drift": {"heading_deg": 0.05}})), ())
    assert note.endswith("no accuracies of the INS's log are used: horizontal 15 mm, vertical 20 mm, "
                         "roll and pitch 0.01°, time constant 200 s")  # fmt: skip
    ins = {"title": "I", "sensor": "ins", "settings": {"drift": {"heading_deg": 0.05}}}
    of_preset = _settings(tmp_path, session(tmp_path, {"mine": ins}, ins={"instrument": "mine"}))
    assert "heading" not in drift_note(of_preset, ())
    assert "nor the INS's log states them: horizontal 15 mm" in drift_note(of_preset, ())


def test_the_stated_keys_are_kept_in_run_yaml(tmp_path: Path) -> None:
    found = session(tmp_path, laser={"range_sigma_m": 0.005})
    settings = _settings(tmp_path, found)
    assert "laser.range_sigma_m" in settings.stated["session"]
    assert not {"laser", "laser.mount", "laser.angle_sigma_deg"} & {*settings.stated["session"]}
    (tmp_path / "run").mkdir()
    write_settings(tmp_path / "run", settings)
    again = read_settings(tmp_path / "run")
    assert {name: list(keys) for name, keys in again.stated.items()} == {
        name: list(keys) for name, keys in settings.stated.items()
    }
