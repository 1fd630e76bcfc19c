"""``poolcal check`` on a simulated session, and what it finds there."""

import json
from pathlib import Path
from typing import Any

from tests.support.places import poolcal

FINE: dict[str, Any] = {"ins": {"rate_hz": 100.0}, "mbes": {"ping_rate_hz": 10.0}}
SBET = {"ins": {"rate_hz": 100.0, "format": "sbet"}}


def checked(session: Path) -> tuple[int, list[dict[str, Any]]]:
    told = poolcal("check", session, "--config", session / "pool.yaml", "--json")
    assert told.status in (0, 1), told.err
    return told.status, json.loads(told.out)["findings"]


def assert_only(session: Path, question: str, *words: str, severity: str = "fault") -> str:
    """One kind of finding alone, in these words; return the first finding."""
    status, found = checked(session)
    assert {one["question"] for one in found} == {question}, found
    assert {one["severity"] for one in found} == {severity}
    assert status == (severity == "fault")
    said = " ".join(one["words"] for one in found)
    for word in words:
        assert word in said, said
    assert all("\n" not in one["words"] for one in found)
    return str(found[0]["words"])
