"""``poolcal coarse``: mounts from a survey of marks, on the screen, as YAML, and into session.yaml."""

from pathlib import Path

import yaml

from pipeline.atomic_files import write_text
from pipeline.coarse import mounts_from_marks as calibrating
from pipeline.coarse.session_edit import SENSORS, origin_of, read_session, written
from pipeline.config.marks import load_marks
from pipeline.config.mount import Mount
from pipeline.config.yaml_models import parse
from pipeline.mount import mount_of
from pipeline.run.output_files import refuse_output
from stages.commands.answer import print_answer


def command(file: Path, session: Path, out: Path | None, write: bool) -> int:
    """Print the mounts, and write them into session.yaml; 1 if the marks do not agree.

    Parameters
    ----------
    file
        The survey of the marks.
    session
        Folder with session.yaml.
    out
        File for all of it as YAML; None: none.
    write
        Put the mounts into session.yaml.
    """
    refuse_output("--yaml", out, session, begins=b"agrees:")
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
        blocks = calibrating.blocks_of(answer, origin_of("coarse", file))
        said.append(written(session, text, content, blocks) if write else f"{path}: not written (--no-write)")
        missing = [name for name in SENSORS if name not in present and name not in blocks]
        said += [f"But {name} still has no mount there." for name in missing]
    return print_answer("\n".join(said), answer.agrees)
