"""Presets of instruments: the files say what they are, and stand between a session's own keys and the defaults."""

import json
import os
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from pipeline.config import instruments
from pipeline.config.instruments import PRESETS, load_instrument, merge_presets
from pipeline.config.load import load_session
from pipeline.config.pool import PoolConfig
from pipeline.config.session import Drift, SessionConfig, White
from pipeline.config.yaml_file import read_yaml
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from pipeline.planning import assessment
from pipeline.report.calibration_document import instruments_block
from pipeline.run.settings import Settings, read_settings, write_settings
from tests.support.preset_sessions import FOREIGN, MOUNT, content, session, write

FILES = sorted(PRESETS.glob("*.yaml"))
LEAF = re.compile(r"^( *)(\w+): *([^#]*?) *(?:# (.*))?$")


def refused(folder: Path, presets: dict[str, Any] | None = None, **blocks: dict[str, Any]) -> str:
    with pytest.raises(ConfigError) as error:
        session(folder, presets, **blocks)
    (line,) = str(error.value).splitlines()
    return line.replace(str(folder), "S")


SONAR: dict[str, Any] = {"title": FOREIGN, "sensor": "mbes", "settings": {"range_sigma_m": 0.02}}


# --- the files -------------------------------------------------------------------------------------------------------
def test_the_instruments_of_the_boat_are_there() -> None:
    assert {"r2sonic_2024", "riegl_vz1000", "novatel_span_lci"} <= {path.stem for path in FILES}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_figure_has_its_source_or_is_in_the_list(path: Path) -> None:
    """Comments of the file against its list ``unverified``, both ways."""
    doubted, sourced, above = [], [], [""]
    for line in path.read_text(encoding="utf-8").splitlines():
        found = LEAF.match(line)
        if found is None or found[2] in ("title", "sensor", "unverified"):
            continue
        depth = len(found[1]) // 2
        above[depth:] = [found[2]]
        if found[3]:
            key = ".".join(above).removeprefix("settings.")
            assert found[4], f"{key} has no comment"
            (doubted if found[4].startswith("unverified: ") else sourced).append(key)
    given = load_instrument(path)
    assert doubted == list(given.unverified)
    leaves = [len(value) if isinstance(value, dict) else 1 for value in given.settings.values()]
    assert len(doubted) + len(sourced) == sum(leaves) + len(given.rates)
    assert max(map(len, path.read_text(encoding="utf-8").splitlines())) <= 120


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_each_stands_over_the_defaults_and_under_the_session(path: Path, tmp_path: Path) -> None:
    given = load_instrument(path)
    found = session(tmp_path, **{given.sensor: {"instrument": path.stem}})
    block = getattr(found, given.sensor)
    assert (block.instrument.name, block.instrument.title) == (path.stem, given.title)
    plain = getattr(session(tmp_path), given.sensor).model_dump(mode="json")
    expected = instruments.deep_merge(plain, given.settings) | {"instrument": None}
    assert block.model_copy(update={"instrument": None}).model_dump(mode="json") == expected
    assert set(block.instrument.origins.values()) == {"preset", "default"}
    for sensor in {"ins", "laser", "mbes"} - {given.sensor}:
        assert getattr(found, sensor).instrument is None


def test_their_page_lists_them() -> None:
    text = (PRESETS.parents[1] / "docs" / "reference" / "instruments.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| (\w+) \| (.+?) \|$", text, flags=re.MULTILINE)
    assert sorted(rows) == [(path.stem, (one := load_instrument(path)).sensor, one.title) for path in FILES]


# --- precedence ------------------------------------------------------------------------------------------------------
def test_the_sessions_own_key_wins_key_by_key(tmp_path: Path) -> None:
    drift = {"horizontal_m": 0.04, "vertical_m": 0.05, "heading_deg": 0.06}
    preset = {"title": "I", "sensor": "ins", "settings": {"drift": drift}}
    found = session(tmp_path, {"mine": preset}, ins={"instrument": "mine", "drift": {"vertical_m": 0.5}}).ins
    assert found.drift == Drift(horizontal_m=0.04, vertical_m=0.5, heading_deg=0.06)
    assert found.white == White()
    assert found.instrument is not None
    assert found.instrument.origins == {
        "drift.horizontal_m": "preset",
        "drift.vertical_m": "session",
        "drift.roll_pitch_deg": "default",
        "drift.heading_deg": "preset",
        "drift.time_constant_s": "default",
        "white.position_m": "default",
        "white.attitude_deg": "default",
    }


def test_what_the_session_itself_gave_is_told(tmp_path: Path) -> None:
    for drift, own in (({}, False), ({"drift": {"heading_deg": 0.1}}, True)):
        merged, keys = merge_presets(content(ins={"instrument": "novatel_span_lci"} | drift), tmp_path)
        assert "drift" in merged["ins"]
        assert ("ins.drift" in keys, "ins.drift.heading_deg" in keys) == (own, own)
        assert "ins.drift.vertical_m" not in keys


def test_null_and_no_instrument_change_nothing(tmp_path: Path) -> None:
    assert session(tmp_path, mbes={"instrument": None}) == session(tmp_path)
    assert session(tmp_path) == parse(SessionConfig, {"name": tmp_path.name} | content(), "")


def test_a_preset_in_the_session_folder_comes_first(tmp_path: Path) -> None:
    assert session(tmp_path, mbes={"instrument": "r2sonic_2024"}).mbes.range_sigma_m == 0.0125
    found = session(tmp_path, {"r2sonic_2024": SONAR}, mbes={"instrument": "r2sonic_2024"}).mbes
    assert (found.range_sigma_m, found.beam_deg) == (0.02, (0.5, 1.0))


def test_the_projectors_place_is_documented_and_not_applied(tmp_path: Path) -> None:
    assert session(tmp_path, mbes={"instrument": "r2sonic_2024"}).mbes.projector_offset_m is None
    lines = (PRESETS / "r2sonic_2024.yaml").read_text(encoding="utf-8").splitlines()
    (line,) = [line for line in lines if line.startswith("  # projector_offset_m:")]
    preset = SONAR | {"settings": yaml.safe_load(line.replace("# ", ""))}
    assert session(tmp_path, {"mine": preset}, mbes={"instrument": "mine"}).mbes.projector_offset_m == (0, 0, 0.119)


def test_run_yaml_is_read_again_without_the_preset(tmp_path: Path) -> None:
    preset = SONAR | {"unverified": ["range_sigma_m"], "rates": {"beams": 512, "ping_rate_hz": 12.5}}
    found = session(tmp_path, {"mine": preset}, mbes={"instrument": "mine"}, laser={"instrument": "riegl_vz1000"})
    pool = parse(PoolConfig, {"target": read_yaml(PRESETS.parent / "defaults.yaml")["target"]}, "")
    (tmp_path / "run").mkdir()
    write_settings(tmp_path / "run", Settings(tmp_path, pool, found))
    (tmp_path / "instruments" / "mine.yaml").unlink()
    (tmp_path / "session.yaml").unlink()
    assert read_settings(tmp_path / "run").session == found


# --- refusals --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("name", ["../evil", "a/b", "/etc/passwd", "R2Sonic", "", "a.yaml", "a\n", 3, ["a"], {"a": 1}])
def test_what_is_no_name(name: Any, tmp_path: Path) -> None:
    line = refused(tmp_path, mbes={"instrument": name})
    assert line.startswith("S/session.yaml: mbes.instrument = ")
    assert line.endswith(": is no name, of a-z, 0-9 and _; known for mbes: r2sonic_2024")


def test_unknown_ones_and_those_of_another_sensor(tmp_path: Path) -> None:
    presets = {"mine": SONAR, "broken": {"title": 3}}
    assert refused(tmp_path, presets, mbes={"instrument": "r2sonic_2025"}) == (
        "S/session.yaml: mbes.instrument = 'r2sonic_2025': no such instrument; known for mbes: mine, r2sonic_2024"
    )
    assert refused(tmp_path, mbes={"instrument": "riegl_vz1000"}) == (
        "S/session.yaml: mbes.instrument = 'riegl_vz1000': is a preset for laser (RIEGL VZ-1000); "
        "known for mbes: mine, r2sonic_2024"
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"settings": {"range_sigma": 0.02}}, "range_sigma: unknown key; is it range_sigma_m? known here: angle_"),
        ({"settings": {"files": ["x"]}}, "settings: files: unknown key"),
        ({"settings": {"mount": MOUNT}}, "settings: mount: unknown key"),
        ({"settings": {"range_sigma_m": -1.0}}, "settings: range_sigma_m = -1.0: input should be greater"),
        ({"settings": {"beam_deg": [0.5]}}, "settings: beam_deg.1: is missing"),
        ({"settings": {"range_sigma_m": "0,02"}}, "with a point where the comma is"),
        ({"settings": {"range_sigma_m": float("nan")}}, "settings.range_sigma_m = nan: is not a finite number"),
        ({"rates": {"pings": 3}}, "rates: pings: unknown key; known here: beams"),
        ({"rates": {"beams": 1e9}}, "rates: beams = "),
        ({"unverified": ["beam_deg"]}, "unverified: 'beam_deg': is given no value here"),
        ({"sensor": "radar"}, "sensor = 'radar'"),
        ({"extra": 1}, "extra: unknown key"),
    ],
)
def test_a_fault_in_a_preset_names_its_file(change: dict[str, Any], words: str, tmp_path: Path) -> None:
    line = refused(tmp_path, {"mine": SONAR | change}, mbes={"instrument": "mine"})
    assert line.startswith("S/instruments/mine.yaml: ")
    assert words in line


def test_no_path_leads_out_of_the_session_folder(tmp_path: Path) -> None:
    (tmp_path / "s" / "instruments").mkdir(parents=True)
    write(tmp_path / "outside.yaml", SONAR)
    link = tmp_path / "s" / "instruments" / "mine.yaml"
    for make in (lambda: link.symlink_to(tmp_path / "outside.yaml"), lambda: os.mkfifo(link), link.mkdir):
        make()
        assert refused(tmp_path / "s", mbes={"instrument": "mine"}) == (
            "S/instruments/mine.yaml: is no file inside the session folder; put the preset itself there"
        )
        link.rmdir() if link.is_dir() else link.unlink()


def test_a_block_that_is_none_is_refused_as_before(tmp_path: Path) -> None:
    (tmp_path / "session.yaml").write_text("mbes: 3\nins: []\nlaser: {}\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"session\.yaml: ins = \[\]"):
        load_session(tmp_path)


# --- where they are seen ---------------------------------------------------------------------------------------------
def test_a_plan_takes_the_rates_that_it_leaves_out(tmp_path: Path) -> None:
    (tmp_path / "PLAN.yaml").write_text(
        "passes: [{distance_m: 4}]\nins_height_m: 0.5\nmbes: {beams: 100}\n", encoding="utf-8"
    )
    plain = assessment.load_plan(tmp_path / "PLAN.yaml", session(tmp_path))
    assert (plain.mbes.ping_rate_hz, plain.mbes.beams) == (20, 100)
    assert (plain.laser.line_rate_hz, plain.ins_rate_hz) == (50, 200)
    ins = {"title": "I", "sensor": "ins", "rates": {"ins_rate_hz": 100}}
    names = {"ins": "mine", "laser": "riegl_vz1000", "mbes": "r2sonic_2024"}
    named = {sensor: {"instrument": name} for sensor, name in names.items()}
    plan = assessment.load_plan(tmp_path / "PLAN.yaml", session(tmp_path, {"mine": ins}, **named))
    assert (plan.mbes.ping_rate_hz, plan.mbes.beams, plan.mbes.max_range_m) == (60, 100, 15)
    assert (plan.laser.line_rate_hz, plan.laser.field_deg, plan.ins_rate_hz) == (120, (30, 130), 100)


def test_calibration_json_names_them(tmp_path: Path) -> None:
    preset = SONAR | {"unverified": ["range_sigma_m"]}
    found = session(tmp_path, {"mine": preset}, mbes={"instrument": "mine"})
    shown = instruments_block({"ins": found.ins, "laser": found.laser, "mbes": found.mbes})
    assert shown == {"instruments": {"mbes": {"name": "mine", "title": FOREIGN, "unverified": ["range_sigma_m"]}}}
    assert json.loads(json.dumps(shown)) == shown
    plain = session(tmp_path)
    assert instruments_block({"ins": plain.ins, "laser": plain.laser, "mbes": plain.mbes}) == {}
