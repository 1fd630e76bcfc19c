"""The patent's target by its faces, through files and the command line: the same bytes."""

import pytest
import yaml

from stages import ORDER
from tests.support.pages import Page
from tests.support.places import Place, digests, poolcal
from tests.support.targets import as_faces


@pytest.mark.thorough
def test_faces_give_the_same_bytes_as_the_letters(place: Place, right: dict[str, str]) -> None:
    content = yaml.safe_load(place.config.read_text(encoding="utf-8"))
    content["target"] = as_faces(content["target"])
    place.config.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    told = place.calibrate("--report", "--recordings")
    assert (told.status, told.complaints) == (0, []), told.err
    assert digests(place.run) == right
    page = place.run / "report" / "report.html"
    assert "target.faces.P2.corners" in page.read_text(encoding="utf-8")
    settings = yaml.safe_load((place.run / "run.yaml").read_text(encoding="utf-8"))
    del settings["stated"]  # as an older version wrote it: names of faces are names of no settings
    (place.run / "run.yaml").write_text(yaml.safe_dump(settings, allow_unicode=True), encoding="utf-8")
    page.unlink()
    assert poolcal("report", place.run).status == 0
    (row,) = [row for row in Page(page.read_text("utf-8")).table("from", "key") if row[1] == "target.faces.P2.corners"]
    assert row[0] == "pool"
    assert sorted(path.stem for path in place.run.glob("*/*.rrd")) == sorted(ORDER)


def test_a_face_that_makes_no_sense_is_one_line(place: Place) -> None:
    content = yaml.safe_load(place.config.read_text(encoding="utf-8"))
    content["target"] = as_faces(content["target"])
    content["target"]["faces"]["P2"]["corners"].reverse()
    place.config.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    told = place.calibrate()
    assert told.status == 2
    (line,) = told.complaints
    assert "pool.yaml: target.faces.P2: corners: the face looks away from the boat" in line
