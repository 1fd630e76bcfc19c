"""Keep an accepted calibration when a new result replaces it: its files stay in RUN/report.1, report.2, ..."""

from pathlib import Path

from pipeline.artefacts.catalogue.results import CALIBRATION_JSON, CALIBRATION_YAML
from pipeline.atomic_files import flush_names, flush_to_disk, read_json, remove, write_bytes, writing
from pipeline.run.folder import keeping, partial
from pipeline.run.results import PAGE

KEPT = (CALIBRATION_JSON.name, CALIBRATION_YAML.name, PAGE)


def keep_accepted(stage: Path) -> Path | None:
    """Copy the accepted result that the partial folder is about to replace, and return the folder of the copy.

    None: there is no accepted result, the new result is the same, or the old one was kept before. The copy is complete
    before anything is replaced. If the process is killed, the result is therefore in its old place, in the copy, or in
    both.
    """
    if not _is_accepted(stage) or _result(stage) == _result(partial(stage)):
        return None
    numbers = [int(path.suffix[1:]) for path in stage.parent.glob(f"{stage.name}.*") if path.suffix[1:].isdecimal()]
    for number in sorted(numbers):
        before = stage.with_name(f"{stage.name}.{number}")
        if _result(before) == _result(stage):
            _copy(stage, before)
            return None
    remove(keeping(stage))
    with writing(keeping(stage)):
        keeping(stage).mkdir()
    _copy(stage, keeping(stage))
    flush_to_disk(keeping(stage))
    kept = stage.with_name(f"{stage.name}.{max(numbers, default=0) + 1}")
    with writing(kept):
        keeping(stage).rename(kept)
    flush_names(stage.parent)
    return kept


def _copy(stage: Path, place: Path) -> None:
    """Copy the files of a result that ``place`` does not have yet."""
    for name in KEPT:
        if (stage / name).is_file() and not (place / name).is_file():
            with writing(place / name):
                content = (stage / name).read_bytes()
            write_bytes(place / name, content)


def _is_accepted(stage: Path) -> bool:
    try:
        content = read_json(stage / CALIBRATION_JSON.name)
    except (OSError, ValueError):
        return False
    return isinstance(content, dict) and content.get("verdict") == "accepted"


def _result(stage: Path) -> bytes | None:
    path = stage / CALIBRATION_JSON.name
    with writing(path):
        return path.read_bytes() if path.is_file() else None
