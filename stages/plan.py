"""``poolcal plan``: passes judged before they are sailed, on the screen, as YAML and as a recording."""

from pathlib import Path

import yaml

from pipeline import planned
from pipeline.files import write_text, writing
from pipeline.folder import load_settings


def plan(file: Path, session: Path, config: Path, out: Path | None, rrd: Path | None) -> tuple[str, bool]:
    """What the screen says, and whether the passes will do."""
    settings = load_settings(session, config)
    pool, wanted = settings.pool, planned.load_plan(file, settings.session)
    answer = planned.judge(wanted, pool, settings.session)
    said = planned.table(answer, pool.verdict)
    if rrd is not None:
        from stages.views.plan import save_plan

        with writing(rrd):
            save_plan(answer, said, rrd)
    if out is not None:
        write_text(out, yaml.safe_dump(planned.as_plain(answer), sort_keys=False))
    return said, planned.is_enough(answer, pool.verdict)
