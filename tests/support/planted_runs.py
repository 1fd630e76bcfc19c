"""Run folders with nothing but a result, for what only reads results."""

import json
from pathlib import Path
from typing import Any


def planted(folder: Path, template: Path, name: str, day: int, **changes: Any) -> None:
    """A run folder with nothing but its result, changed."""
    result = json.loads((template / "report" / "calibration.json").read_text(encoding="utf-8"))
    result["session"] = changes.get("session", name)
    result["verdict"] = changes.get("verdict", "accepted")
    result["passes"][0]["start_utc"] = f"2026-05-{day:02d}T{changes.get('hour', 8):02d}:00:00Z"
    if changes.get("laser"):
        result["calibrated"] = "laser"
    for key in changes.get("without", ()):
        del result[key]
    shift = changes.get("z_m", 0.0)
    for block in (result["mbes"], result["methods"]["adjustment"]):
        block["lever_arm_m"][2] += shift
        block["mount"]["z_m"] += shift
    if changes.get("nothing"):
        for block in (result["mbes"], result["methods"]["adjustment"]):
            block.update(dict.fromkeys(block))
    (folder / name / "report").mkdir(parents=True)
    text = json.dumps(result, ensure_ascii=False)
    (folder / name / "report" / "calibration.json").write_text(text, encoding="utf-8")
