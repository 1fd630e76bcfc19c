"""``poolcal coarse``: mounts from a survey of marks, on the screen, in a YAML file, and in session.yaml."""

from pathlib import Path

import yaml

from pipeline.atomic_files import write_text
from pipeline.coarse.marks_text import marks_text, marks_values
from pipeline.coarse.mounts_from_marks import assess_marks, mount_blocks
from pipeline.coarse.session_file import SENSORS, mount_origin, read_session, write_mounts
from pipeline.config.marks import load_marks
from pipeline.config.mount import Mount
from pipeline.config.yaml_models import parse
from pipeline.mount import mount_of
from pipeline.run.output_files import refuse_output
from stages.commands.answer import print_answer


def command(file: Path, session: Path, out: Path | None, write: bool) -> int:
    """Print the mounts, and write them into session.yaml; return 1 if the marks do not agree.

    Parameters
    ----------
    file
        The YAML file with the survey's marks.
    session
        The folder with session.yaml.
    out
        The YAML file for all results; None: no file is written.
    write
        Whether to write the mounts into session.yaml if the marks agree.
    """
    refuse_output("--yaml", out, session, begins=b"agrees:")
    text, content = read_session(session)
    path = session / "session.yaml"
    settings = {name: content[name]["mount"] for name in SENSORS if "mount" in content.get(name, {})}
    present = {name: mount_of(parse(Mount, mount, f"{path}: {name}.mount")) for name, mount in settings.items()}
    marks = load_marks(file)
    assessment = assess_marks(marks, str(file), present)
    lines = [marks_text(assessment, present)]
    if out is not None:
        write_text(out, yaml.safe_dump(marks_values(assessment, present), sort_keys=False, allow_unicode=True))
    if assessment.agrees:
        blocks = mount_blocks(assessment, mount_origin("coarse", file))
        lines.append(write_mounts(session, text, content, blocks) if write else f"{path}: not written (--no-write)")
        missing = [name for name in SENSORS if name in content and name not in present and name not in blocks]
        lines += [f"But {name} still has no mount there." for name in missing]
    return print_answer("\n".join(lines), assessment.agrees)
