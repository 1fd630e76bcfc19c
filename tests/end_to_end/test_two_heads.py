"""A sonar with two heads through the command line: each head is named everywhere, and none is taken silently."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline.config.yaml_file import read_yaml
from tests.support.mount_errors import rotation_error
from tests.support.places import digests, poolcal, poolcal_process, result_of

FIRST = {"roll_deg": -48.8, "pitch_deg": 1.2, "yaw_deg": -2.0, "x_m": 0.30, "y_m": 0.20, "z_m": -2.01}
SECOND = {"roll_deg": -38.0, "pitch_deg": -0.9, "yaw_deg": 1.6, "x_m": -0.30, "y_m": -0.25, "z_m": -2.05}
SCENARIO: dict[str, Any] = {
    "name": "two",
    "track": {"distances_m": [4.0, 7.0], "half_length_m": 4.0},
    "laser": {"point_rate_hz": 2000.0, "line_rate_hz": 20.0, "format": "las"},
    "ins": {"rate_hz": 50.0},
    "mbes": [{"mount": dict(mount), "ping_rate_hz": 6.0} for mount in (FIRST, SECOND)],
}
Run = Callable[..., Any]


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("two")
    (place / "two.yaml").write_text(yaml.safe_dump(SCENARIO), encoding="utf-8")
    assert poolcal("simulate", place / "session", "--scenario", place / "two.yaml", "--seed", 3).status == 0
    return place / "session"


@pytest.fixture(scope="module")
def run(session: Path) -> Path:
    folder = session.with_name("run")
    told = calibrated(session, folder, "--report")
    assert told.status == 0, told.err
    return folder


def calibrated(session: Path, folder: Path, *options: str) -> Any:
    return poolcal("run", session, "--config", session / "pool.yaml", "--run", folder, "--no-recordings", *options)


def changed(session: Path, place: Path, heads: Callable[[list[dict[str, Any]]], Any]) -> Path:
    """The session in another folder, of which session.yaml has other heads; the raw files are the same."""
    folder = place / "session"
    shutil.copytree(session, folder)
    content = read_yaml(session / "session.yaml")
    content["mbes"] = heads(content["mbes"])
    (folder / "session.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    return folder


def test_both_heads_are_found_named_and_judged(session: Path, run: Path) -> None:
    truth = json.loads(session.with_name("session.truth.json").read_text())
    result = result_of(run)
    errors = [
        np.r_[
            rotation_error(true["R_body_from_mbes"], head["R_body_from_mbes"]),
            np.subtract(true["lever_arm_m"], head["lever_arm_m"]),
        ]
        for true, head in zip(truth["heads"], result["heads"], strict=True)
    ]
    error, covariance = np.concatenate(errors), np.array(result["heads_covariance"]["covariance"])
    assert error @ np.linalg.solve(covariance, error) < 32.9  # 99.9 % of twelve
    assert set(result["inputs"]) >= {f"{head}/pass_{k}.xtf" for head in ("mbes", "mbes_2") for k in range(2)}
    page = (run / "report" / "report.html").read_text(encoding="utf-8")
    for head in result["heads"]:
        assert f"{head['mount']['roll_deg']:.3f} °" in page


def test_a_second_run_has_nothing_to_do_and_verify_looks_at_both(session: Path, run: Path) -> None:
    told = calibrated(session, run)
    assert told.status == 0
    assert told.err.count("up to date") == 8 + 6  # the first head's stages, and those of the second up to its labels
    assert "mbes mount" in told.out
    assert "mbes_2 mount" in told.out
    assert "--head mbes_2 --to NAME" in told.out
    assert poolcal("verify", run).status == 0
    victim = next((run / "heads" / "mbes_2" / "segment" / "soundings_labelled").iterdir())
    spoilt = victim.read_bytes()
    try:
        victim.write_bytes(spoilt[:-1] + bytes([spoilt[-1] ^ 1]))
        told = poolcal("verify", run)
        assert told.status == 1
        assert "mbes_2/segment" in told.out + told.err
    finally:
        victim.write_bytes(spoilt)


@pytest.mark.thorough
def test_another_coarse_mount_of_the_second_head_runs_its_stages_and_the_adjustment_again(
    session: Path, run: Path, tmp_path: Path
) -> None:
    def turned(heads: list[dict[str, Any]]) -> list[dict[str, Any]]:
        heads[1]["mount"]["roll_deg"] += 0.1
        return heads

    other = changed(session, tmp_path, turned)
    again = tmp_path / "run"
    assert calibrated(other, again).status == 0
    content = read_yaml(other / "session.yaml")
    content["mbes"][1]["mount"]["roll_deg"] -= 0.1
    (other / "session.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    told = calibrated(other, again)
    assert told.status == 0
    stages = [line.partition(":")[0] for line in told.err.splitlines() if ": done in" in line]
    assert "mbes_2/georeference" in stages
    assert "adjust" in stages
    assert "mbes_2/ingest" not in stages
    assert "segment" not in stages
    assert digests(again) == digests(run)


def test_with_one_head_left_it_is_a_run_of_one(session: Path, run: Path, tmp_path: Path) -> None:
    """A list of one writes the same bytes as a block, also into the folder of a run that had two heads."""
    for name, heads in (("block", lambda heads: heads[0]), ("list", lambda heads: heads[:1])):
        (tmp_path / name).mkdir()
        changed(session, tmp_path / name, heads)
    shutil.copytree(run, tmp_path / "b")
    assert calibrated(tmp_path / "block" / "session", tmp_path / "a").status == 0
    assert calibrated(tmp_path / "list" / "session", tmp_path / "b").status == 0
    assert digests(tmp_path / "a") == digests(tmp_path / "b")
    assert not (tmp_path / "b" / "heads").exists()
    assert "heads" not in result_of(tmp_path / "b")


def test_exports_name_the_head(run: Path) -> None:
    told = poolcal("export", run, "--to", "qimera")
    assert told.status == 2
    assert "has 2 heads, mbes and mbes_2: say which, --head NAME" in told.err
    blocks = result_of(run)["heads"]
    for block in blocks:
        told = poolcal("export", run, "--to", "qimera", "--head", block["name"])
        assert told.status == 0
        assert f"head {block['name']}" in " ".join(told.out.split())
        assert f"{block['mount']['roll_deg']:.4f}" in told.out
    assert poolcal("export", run, "--to", "qimera", "--head", "mbes_3").status == 2


def test_diff_goes_head_by_head(run: Path) -> None:
    told = poolcal("diff", run, run, "--json")
    assert told.status == 0
    difference = json.loads(told.out)
    assert [head["name"] for head in difference["heads"]] == ["mbes", "mbes_2"]
    assert all(head["sentence"] == "the same result in both" for head in difference["heads"])


def test_a_head_that_moved_is_the_one_that_diff_names(session: Path, run: Path, tmp_path: Path) -> None:
    """The second session's second head was turned by half a degree; the first head stood still."""
    (tmp_path / "s").mkdir()
    moved = dict(SCENARIO, name="moved")
    moved["mbes"] = [dict(head) for head in SCENARIO["mbes"]]
    moved["mbes"][1]["mount"] = SECOND | {"yaw_deg": SECOND["yaw_deg"] + 0.5}
    (tmp_path / "moved.yaml").write_text(yaml.safe_dump(moved), encoding="utf-8")
    later = tmp_path / "s" / "session"
    assert poolcal("simulate", later, "--scenario", tmp_path / "moved.yaml", "--seed", 4).status == 0
    assert calibrated(later, tmp_path / "later").status == 0
    told = poolcal("diff", run, tmp_path / "later", "--json")
    assert told.status == 1
    first, second = json.loads(told.out)["heads"]
    assert first["answer"] != "moved"
    assert second["answer"] == "moved"
    assert not second["errors"]["cautious"]
    assert [row["parameter"] for row in second["parameters"] if row["moved"]] == ["yaw"]


@pytest.mark.parametrize(
    "command",
    [
        ("check", "SESSION", "--config", "POOL"),
        ("plan", "POOL", "--session", "SESSION", "--config", "POOL"),
        ("stage", "adjust", "RUN"),
        ("check-entry", "RUN", "POOL"),
        ("compare", "RUN", "TRUTH"),
        ("export", "RUN", "--to", "las", "--out", "OUT"),
        ("diff", "RUN", "RUN", "--html", "OUT"),
    ],
    ids=lambda command: command[0],
)
def test_what_takes_one_head_says_so_in_a_line(
    session: Path, run: Path, tmp_path: Path, command: tuple[str, ...]
) -> None:
    places = {
        "SESSION": session, "RUN": run, "POOL": session / "pool.yaml", "OUT": tmp_path / "out.las",
        "TRUTH": session.with_name("session.truth.json"),
    }  # fmt: skip
    told = poolcal(*(places.get(word, word) for word in command))
    assert told.status == 2
    assert len(told.err.strip().splitlines()) == 1
    assert "heads" in told.err
    assert not (tmp_path / "out.las").exists()


def test_history_says_what_it_leaves_out(run: Path) -> None:
    told = poolcal("history", run.parent)
    assert "with 2 heads" in told.err + told.out


def test_repeat_leaves_the_session_alone_and_says_why(session: Path, tmp_path: Path) -> None:
    listed = {"session": str(session), "config": str(session / "pool.yaml"), "run": str(tmp_path / "run")}
    fleet = {"sessions": [listed]}
    (tmp_path / "fleet.yaml").write_text(yaml.safe_dump(fleet), encoding="utf-8")
    told = poolcal_process("repeat", tmp_path / "fleet.yaml")
    assert told.status == 2
    assert "mbes: lists 2 heads" in told.err + told.out
    assert not (tmp_path / "run").exists()
