"""Scenarios and sessions as a whole: strictness, repeatability, refusals, and what the noise amounts to."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import laspy
import numpy as np
import pytest

from pipeline.config.load import load_pool, load_session
from pipeline.config.yaml_file import read_yaml
from pipeline.errors import ConfigError
from pipeline.simulation import session as session_module
from pipeline.simulation.ins_errors import gauss_markov_drift
from pipeline.simulation.motion import Movement
from pipeline.simulation.scenario import Scenario, load_scenario
from pipeline.simulation.session import simulate_session, simulate_to_folder, write_session
from tests.support.roots import SCENARIOS

Change = Callable[..., Scenario]
NAMES = sorted(path.stem for path in SCENARIOS.glob("*.yaml"))


def digests(folder: Path) -> dict[str, str]:
    files = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def keys(content: object) -> object:
    return {key: keys(value) for key, value in content.items()} if isinstance(content, dict) else None


def test_default_yaml_is_the_default_and_names_every_key(scenarios: Path) -> None:
    path = scenarios / "default.yaml"
    assert load_scenario(path) == load_scenario(None) == Scenario()
    assert keys(read_yaml(path)) == keys(Scenario().model_dump())


@pytest.mark.parametrize("name", NAMES)
def test_committed_scenarios_are_valid_and_carry_their_name(scenarios: Path, name: str) -> None:
    assert load_scenario(scenarios / f"{name}.yaml").name == name


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("mbes: {ping_rate: 20}", "mbes.ping_rate: unknown key"),
        ("track: {distances_m: []}", "track.distances_m"),
        ("start_utc: 2026-05-12T08:00:00+02:00", "start_utc"),
        ("start_utc: '2026-05-12T08:00:00+02:00'", "start_utc"),
        ("mbes: {sub_rays: [4, 3]}", "sub_rays"),
        ("track: {ins_height_m: 3.0}", "puts the sonar"),
        ("track: {half_length_m: 0.01}", "a second or more"),
        ("target: {a: 8, b: 3, c: 1, e: 0.5, origin: {latitude_deg: 1, longitude_deg: 1, height_m: 1}}", "azimuth"),
        ("laser: {range_sigma_m: -1}", "laser.range_sigma_m"),
    ],
)
def test_faulty_scenarios_are_refused_by_name(tmp_path: Path, text: str, named: str) -> None:
    path = tmp_path / "faulty.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=named):
        load_scenario(path)


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path, noisy: Scenario) -> None:
    for name in ("one", "two"):
        write_session(simulate_session(noisy, 7), tmp_path / name, noisy)
    assert digests(tmp_path / "one") == digests(tmp_path / "two")
    assert (tmp_path / "one.truth.json").read_bytes() == (tmp_path / "two.truth.json").read_bytes()
    write_session(simulate_session(noisy, 8), tmp_path / "three", noisy)
    assert digests(tmp_path / "one").keys() == digests(tmp_path / "three").keys()
    assert digests(tmp_path / "one") != digests(tmp_path / "three")


def test_folder_has_its_files_and_the_truth_lies_beside(tmp_path: Path, noisy: Scenario) -> None:
    write_session(simulate_session(noisy, 7), tmp_path / "deep" / "s", noisy)
    found = {"session.yaml", "pool.yaml", "ins/ins.gps"}
    found |= {f"{sensor}/pass_{k}.{end}" for sensor, end in (("laser", "laz"), ("mbes", "xtf")) for k in (0, 1)}
    assert digests(tmp_path / "deep" / "s").keys() == found
    assert {path.name for path in (tmp_path / "deep").iterdir()} == {"s", "s.truth.json"}
    truth = json.loads((tmp_path / "deep" / "s.truth.json").read_text(encoding="utf-8"))
    assert truth["schema"] == 1
    coarse = load_session(tmp_path / "deep" / "s").mbes.mount
    for name, error in truth["coarse_error"].items():
        assert getattr(coarse, name) - truth["mbes"]["mount"][name] == pytest.approx(error)
        assert abs(error) == pytest.approx(0.8 if name.endswith("deg") else 0.08)
    assert load_pool(tmp_path / "deep" / "s" / "pool.yaml").target == noisy.target


def test_existing_folder_is_refused_and_untouched(tmp_path: Path, noisy: Scenario) -> None:
    out = tmp_path / "s"
    out.mkdir()
    (out / "mine.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(ConfigError, match="exists already"):
        simulate_to_folder(out, None, 1)
    with pytest.raises(ConfigError, match="exists already"):
        write_session(simulate_session(noisy, 1), out, noisy)
    assert digests(out).keys() == {"mine.txt"}
    (out / "mine.txt").unlink()
    write_session(simulate_session(noisy, 1), out, noisy)  # an empty folder may be used
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(ConfigError, match="file"):
        simulate_to_folder(tmp_path / "file" / "s", None, 1)


def test_a_failure_leaves_nothing_behind(tmp_path: Path, noisy: Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_space(*_: object) -> None:
        raise OSError(28, "No space left on device")

    simulated = simulate_session(noisy, 1)
    monkeypatch.setattr(session_module, "write_las", no_space)
    with pytest.raises(ConfigError, match="No space left"):
        write_session(simulated, tmp_path / "s", noisy)
    assert list(tmp_path.iterdir()) == []


def test_a_killed_run_is_swept_up_by_the_next(tmp_path: Path, noisy: Scenario) -> None:
    (tmp_path / ".s.partial" / "laser").mkdir(parents=True)
    write_session(simulate_session(noisy, 1), tmp_path / "s", noisy)
    assert {path.name for path in tmp_path.iterdir()} == {"s", "s.truth.json"}


def test_negative_seed_is_refused(noisy: Scenario) -> None:
    with pytest.raises(ConfigError, match="seed = -1"):
        simulate_session(noisy, -1)


def test_one_noise_source_leaves_the_others_alone(changed: Change, noisy: Scenario) -> None:
    plain = simulate_session(noisy, 3)
    other = simulate_session(changed(noisy, laser={"range_sigma_m": 0.0}, mbes={"outlier_share": 0.0}), 3)
    for name in plain.ins:
        np.testing.assert_array_equal(plain.ins[name], other.ins[name])
    assert plain.session["mbes"]["mount"] == other.session["mbes"]["mount"]
    both = {(p, b): t for p, b, t in zip(*(plain.mbes[n] for n in ("ping", "beam", "two_way_time_s")), strict=True)}
    found = zip(*(other.mbes[n] for n in ("ping", "beam", "two_way_time_s")), strict=True)
    same = [both.get((p, b)) == t for p, b, t in found]
    assert np.mean(same) > 0.97


def test_noise_is_what_was_put_in(changed: Change, noise_free: Scenario) -> None:
    true = simulate_session(noise_free, 2)
    noisy = simulate_session(
        changed(
            noise_free, ins={"white": {"position_m": 0.002, "attitude_deg": 0.002}},
            laser={"range_sigma_m": 0.005}, mbes={"range_sigma_m": 0.008},
        ), 2,
    )
    north_m = (noisy.ins["latitude_rad"] - true.ins["latitude_rad"]) * 6_358_000
    assert north_m.std() == pytest.approx(0.002, rel=0.05)
    assert np.degrees(noisy.ins["roll_rad"] - true.ins["roll_rad"]).std() == pytest.approx(0.002, rel=0.05)
    sonar = (noisy.mbes["two_way_time_s"] - true.mbes["two_way_time_s"]) * 750
    assert sonar.std() == pytest.approx(0.008, rel=0.05)
    ranges = [np.linalg.norm([s.laser[n] for n in ("x_m", "y_m", "z_m")], axis=0) for s in (noisy, true)]
    assert (ranges[0] - ranges[1]).std() == pytest.approx(0.005, rel=0.05)


def test_drift_is_stationary_and_correlated(noisy: Scenario) -> None:
    given = load_scenario(SCENARIOS / "drift.yaml").ins.drift
    t_ns = np.concatenate([np.arange(0, 50_000), np.arange(56_000, 100_000)]) * 1_000_000_000  # 1 Hz with a gap
    errors = gauss_markov_drift(given, t_ns, np.random.default_rng(0))
    sigmas = [0.015, 0.015, 0.02, *np.radians([0.01, 0.01, 0.03])]
    np.testing.assert_allclose(errors.std(axis=1), sigmas, rtol=0.12)
    lag = [np.mean(row[:-200] * row[200:]) / row.var() for row in errors]
    np.testing.assert_allclose(lag, np.exp(-1), atol=0.12)
    assert np.all(gauss_markov_drift(noisy.ins.drift, t_ns[:100], np.random.default_rng(0)) == 0)


def test_unwanted_echoes_come_in_the_shares_asked_for(changed: Change, noisy: Scenario) -> None:
    plain = simulate_session(changed(noisy, mbes={"outlier_share": 0.0}), 3)
    wild = simulate_session(changed(noisy, mbes={"outlier_share": 0.1}), 3)
    assert len(wild.mbes["t_ns"]) > len(plain.mbes["t_ns"])  # beams without echo get one too
    dropped = simulate_session(changed(noisy, mbes={"dropped_ping_share": 0.5}), 3)
    assert len(dropped.pings["ping"]) / len(plain.pings["ping"]) == pytest.approx(0.5, abs=0.12)
    assert set(np.diff(dropped.pings["ping"])) > {1, 2}


def test_wide_beams_agree_with_their_axis_on_one_plane_only(changed: Change, noise_free: Scenario) -> None:
    point = simulate_session(noise_free, 2).mbes
    wide = simulate_session(changed(noise_free, mbes={"point_beams": False}), 2).mbes
    first = {(p, b): t for p, b, t in zip(point["ping"], point["beam"], point["two_way_time_s"], strict=True)}
    found = zip(wide["ping"], wide["beam"], wide["two_way_time_s"], strict=True)
    pairs = [(first[p, b], t) for p, b, t in found if (p, b) in first]
    difference = np.abs(np.diff(np.array(pairs), axis=1)) * 750
    assert 0.5 < np.mean(difference == 0) < 0.98
    assert difference.max() > 0.05  # at an edge the echo is a mixture


def test_all_pings_may_drop(changed: Change, noisy: Scenario, tmp_path: Path) -> None:
    scenario = changed(noisy, mbes={"dropped_ping_share": 1.0})
    simulated = simulate_session(scenario, 1)
    assert len(simulated.mbes["t_ns"]) == len(simulated.pings["t_ns"]) == 0
    write_session(simulated, tmp_path / "s", scenario)


def test_logging_on_between_passes(changed: Change, noisy: Scenario) -> None:
    scenario = changed(noisy, track={"log_between_passes": True}, ins={"white": {"position_m": 0, "attitude_deg": 0}})
    ins, movement = simulate_session(scenario, 1).ins, Movement(scenario, 1)
    assert set(np.diff(ins["t_ns"])) == {5_000_000}
    turned = np.degrees(np.unwrap(ins["azimuth_rad"]))
    assert turned[-1] - turned[0] == pytest.approx(-360, abs=5)
    pose = movement.pose(0, ins["t_ns"][ins["t_ns"] < movement.starts_ns[1]])
    steps = np.linalg.norm(np.diff(pose.position_target_m, axis=0), axis=1)
    assert steps.max() < 2.5 * 0.005  # m: never faster than 2.5 m/s
    assert pose.position_target_m[:, 0].max() < -3
    assert np.abs(pose.position_target_m[:, 1]).max() < 15
    assert np.abs(np.diff(ins["latitude_rad"])).max() * 6.4e6 < 2.5 * 0.005  # no jump between the passes' files


def test_pool_yaml_holds_the_surveyors_errors(changed: Change, noisy: Scenario) -> None:
    target = noisy.target.model_dump() | {"azimuth_deg": 90.0}
    wrong = {"origin_error_m": [0.0, 0.2, 0.05], "azimuth_error_deg": 1.5}
    pool = simulate_session(changed(noisy, target=target, surroundings=wrong), 1).pool["target"]
    assert pool["azimuth_deg"] == 91.5
    assert pool["origin"]["height_m"] == pytest.approx(12.05, abs=1e-6)
    east_m = np.radians(pool["origin"]["longitude_deg"] - 120.1) * 6_385_500 * np.cos(np.radians(36.0))
    assert east_m == pytest.approx(0.2, abs=1e-3)  # +y is east there
    without_azimuth = simulate_session(changed(noisy, surroundings={"give_azimuth": False}), 1)
    assert without_azimuth.pool["target"]["azimuth_deg"] is None


def test_sigmas_may_stay_unsaid(changed: Change, noisy: Scenario, tmp_path: Path) -> None:
    content = noisy.model_dump(mode="json") | {"declare_sigmas": False}
    scenario = Scenario.model_validate_json(json.dumps(content), strict=True)
    write_session(simulate_session(scenario, 1), tmp_path / "s", scenario)
    assert not {"drift", "white"} & set(read_yaml(tmp_path / "s" / "session.yaml")["ins"])
    assert not {"beam_deg", "range_sigma_m"} & set(read_yaml(tmp_path / "s" / "session.yaml")["mbes"])
    assert load_session(tmp_path / "s").ins.drift.horizontal_m == 0.015


def test_ecef_points_survive_the_file(changed: Change, noisy: Scenario, tmp_path: Path) -> None:
    scenario = changed(noisy, laser={"frame": "EPSG:4978"})
    simulated = simulate_session(scenario, 1)
    write_session(simulated, tmp_path / "s", scenario)
    las = laspy.read(tmp_path / "s" / "laser" / "pass_0.laz")
    np.testing.assert_allclose(las.x, simulated.laser["x_m"][: simulated.laser_rows[1]], atol=0.51e-4)
