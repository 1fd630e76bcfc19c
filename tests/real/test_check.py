"""What poolcal check makes of real logs of an INS."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.checking.file_survey import survey_files
from pipeline.checking.ins_quality import InsQuality, assess_ins_quality, quality_findings
from pipeline.config.session import Ins, Laser, SessionConfig
from tests.support.real_files import MOUNT


def _quality(data: Path, name: str, **more: object) -> InsQuality:
    ins = Ins(files=[name], **more)
    nothing = Laser(files=["none/*"], format="table", mount=MOUNT)
    seen, _ = survey_files(SessionConfig(name="x", ins=ins, laser=nothing), data)
    return assess_ins_quality(seen, [])


def test_a_log_that_has_not_aligned_says_so(data: Path) -> None:
    found = _quality(data, "ins/oem7_ins2.gps", format="novatel")
    assert found.by_file["ins/oem7_ins2.gps"]["status"] == {"INS_ALIGNMENT_COMPLETE": 62}
    assert found.sigmas["heading_deg"] > 14
    said = {one.words.split(" by the log")[0].split(" to ")[0]: one.severity for one in quality_findings(found)}
    assert said["ins: its heading is good"] == "fault"
    assert said["ins: its position is good"] == "fault"
    (status,) = [one for one in quality_findings(found) if "INS_ALIGNMENT_COMPLETE in 100%" in one.words]
    assert status.severity == "look"  # where the passes are is not known


def test_a_log_processed_with_ppp_is_good_but_for_its_heading(data: Path) -> None:
    found = _quality(data, "ins/propak6-ins-ppp_payload.gps", format="novatel")
    assert found.together == {"status": {"INS_SOLUTION_GOOD": 2289}, "type": {"INS_PPP": 2289}}
    (finding,) = quality_findings(found)
    assert (finding.severity, "heading is good to 0.24°" in finding.words) == ("look", True)


def test_accuracy_files_are_read_beside_an_sbet(data: Path) -> None:
    names = {"format": "sbet", "gps_week": 2024}
    alone = _quality(data, "ins/sbet_ATLANS-20181023.out", **names)
    assert alone.sigmas == {}
    found = _quality(
        data, "ins/sbet_ATLANS-20181023.out", accuracy=["ins/sbet_ATLANS-20181023-accuracy.out"], **names
    )
    rows = np.fromfile(data / "ins/sbet_ATLANS-20181023-accuracy.out", "<f8").reshape(-1, 10)
    assert found.sigmas["heading_deg"] == pytest.approx(np.median(rows[:, 9]) / 60, rel=0.02)
    assert found.sigmas["horizontal_m"] == pytest.approx(np.median(np.hypot(rows[:, 1], rows[:, 2])) / 2**0.5, rel=0.02)
