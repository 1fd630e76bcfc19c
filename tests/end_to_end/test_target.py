"""poolcal target: from a session without a design to a calibration on what the laser saw, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from pipeline.config.load import load_pool
from pipeline.finding.dry_planes import OFF_M
from tests.support.docks import DOCK
from tests.support.places import poolcal, simulate
from tests.support.recordings import points, read, strip, text
from tests.support.refusals import one_line


@pytest.fixture(scope="module")
def dock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session at a wall with two returns."""
    folder = tmp_path_factory.mktemp("dock") / "码头 [1]"
    return simulate(folder, **DOCK, track={"half_length_m": 6.0}, laser={"point_rate_hz": 8000.0})


def test_from_the_laser_alone_to_a_calibration(dock: Path, tmp_path: Path) -> None:
    found = [tmp_path / f"wall-{jobs}.yaml" for jobs in (1, 2)]
    for jobs, file in enumerate(found, start=1):
        told = poolcal("target", dock, "--out", file, "--jobs", jobs)
        assert told.status == 0, told.err
    assert "3 faces of" in told.out
    assert f"Written: {found[1]}" in told.out
    assert found[0].read_bytes() == found[1].read_bytes()
    assert sorted(load_pool(found[0]).target.faces) == ["wall-1", "wall-2", "wall-3"]
    run = tmp_path / "run"
    told = poolcal("run", dock, "--config", found[0], "--run", run)
    assert told.status in (0, 1), told.err
    assert told.ran[-1] == "report"


def test_the_depth_is_that_of_the_faces(dock: Path, tmp_path: Path) -> None:
    file = tmp_path / "wall.yaml"
    assert poolcal("target", dock, "--out", file, "--depth", 2.5).status == 0
    for face in yaml.safe_load(file.read_text(encoding="utf-8"))["target"]["faces"].values():
        assert min(corner[2] for corner in face["corners"]) == pytest.approx(-2.5, abs=0.1)


@pytest.mark.parametrize("depth", ["0", "-4", "1000", "nan"])
def test_a_depth_that_cannot_be_is_refused(dock: Path, depth: str) -> None:
    one_line(poolcal("target", dock, f"--depth={depth}"), "--depth", "must be 0.5 to 100 m")


def test_a_file_of_somebody_elses_is_not_replaced(dock: Path, tmp_path: Path) -> None:
    file = tmp_path / "pool.yaml"
    file.write_text("target: mine\n", encoding="utf-8")
    one_line(poolcal("target", dock, "--out", file), str(file))
    assert file.read_text(encoding="utf-8") == "target: mine\n"
    one_line(poolcal("target", dock, "--out", tmp_path / "pool.txt"), "ends in .yaml")


def test_the_page_replaces_itself_and_nothing_else(dock: Path, tmp_path: Path) -> None:
    page = tmp_path / "place.html"
    for _ in range(2):
        assert poolcal("target", dock, "--html", page).status == 0
    assert "wall-1" in page.read_text("utf-8")
    page.write_text("mine", "utf-8")
    one_line(poolcal("target", dock, "--html", page), str(page))
    assert page.read_text("utf-8") == "mine"
    one_line(poolcal("target", dock, "--html", dock / "place.html"), "place.html")


def test_the_recording_shows_each_face_where_it_stands(dock: Path, tmp_path: Path) -> None:
    """Its points lie on it, above the water, over its whole width."""
    folder = tmp_path / "place"
    folder.mkdir()
    file = folder / "place.rrd"
    for _ in range(2):  # a recording replaces itself
        told = poolcal("target", dock, "--rrd", file)
        assert told.status == 0, told.err
    assert f"Written: {file}" in told.out
    found = read(tmp_path, "place")
    assert {path for path in found if path.endswith("/outline")} == {f"/faces/wall-{k}/outline" for k in (1, 2, 3)}
    assert "wall-2" in text(found, "/tables/place")
    cloud, below = points(found["/faces/wall-2/points"]), strip(found["/faces/wall-2/below"])
    normal = np.cross(below[1] - below[0], below[2] - below[0])
    normal /= np.linalg.norm(normal)
    off_m = np.abs((cloud - below[0]) @ normal)
    assert np.median(off_m) < 0.01
    assert off_m.max() <= OFF_M + 0.01  # what stands before it is shown, too
    assert np.quantile(cloud[:, 2], [0.01, 0.99]) == pytest.approx([0.0, 2.0], abs=0.15)  # the wall above the water
    assert below[:, 2].min() == pytest.approx(-4.0, abs=0.1)
    assert np.ptp(cloud[:, :2] @ np.array([-normal[1], normal[0]])) == pytest.approx(6.0, abs=0.3)
    one_line(poolcal("target", dock, "--rrd", dock / "place.rrd"), "place.rrd")
    one_line(poolcal("target", dock, "--rrd", file, "--bottom", tmp_path), "--rrd", "not with --bottom")
