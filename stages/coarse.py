"""``poolcal coarse``: mounts from a survey of marks, on the screen, as YAML, and into session.yaml."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import yaml

import pipeline
from pipeline import coarse as calibrating
from pipeline.coarse_settings import load_marks
from pipeline.config import Mount
from pipeline.files import sha256, write_text
from pipeline.mounts import mount_of
from pipeline.parsing import parse
from pipeline.session_edit import SENSORS, edited, read_session, refuse_other, replace_session


def coarse(file: Path, session: Path, out: Path | None, write: bool) -> tuple[str, bool]:
    """What the screen says, and whether the marks agree."""
    text, content = read_session(session)
    path = session / "session.yaml"
    given = {name: content[name]["mount"] for name in SENSORS if "mount" in content[name]}
    present = {name: mount_of(parse(Mount, mount, f"{path}: {name}.mount")) for name, mount in given.items()}
    marks = load_marks(file)
    answer = calibrating.judge(marks, str(file), present)
    said = [calibrating.table(answer, present)]
    if out is not None:
        write_text(out, yaml.safe_dump(calibrating.as_plain(answer, present), sort_keys=False, allow_unicode=True))
    if answer.agrees:
        origin = {"method": "coarse", "file": _shown(file.name), "sha256": sha256(file)}
        origin |= {"date": datetime.now(UTC).date().isoformat(), "software": f"poolcal {pipeline.__version__}"}
        blocks = calibrating.blocks_of(answer, origin)
        said.append(_written(session, text, content, blocks) if write else f"{path}: not written (--no-write)")
        missing = [name for name in SENSORS if name not in present and name not in blocks]
        said += [f"But {name} still has no mount there." for name in missing]
    return "\n".join(said), answer.agrees


def _shown(name: str) -> str:
    """A file's name as text of one line."""
    return "".join(letter if letter.isprintable() else "?" for letter in name)[:300]


def _written(session: Path, text: str, content: dict[str, Any], blocks: dict[str, dict[str, Any]]) -> str:
    """Into session.yaml, unless it says so already; the day and the version alone are no change."""
    path = session / "session.yaml"
    if all(_same(content[name], block) for name, block in blocks.items()):
        return f"{path}: has these mounts already; not written"
    new = edited(text, blocks, path)
    refuse_other(new, content, blocks, path)
    kept = replace_session(session, text, new)
    return f"{path}: {' and '.join(f'{name}.mount' for name in blocks)} written; what was there is in {kept.name}"


def _same(there: dict[str, Any], block: dict[str, Any]) -> bool:
    one, other = (side.get("mount_origin") or {} for side in (there, block))
    origins = one.get("sha256") == other["sha256"] and one.get("method") == other["method"]
    return origins and all(there.get(key) == block[key] for key in ("mount", "mount_covariance"))
