"""``poolcal plan``: passes judged before they are sailed, on the screen, as YAML and as a recording."""

from pathlib import Path

import yaml

from pipeline import planned
from pipeline.config import load_pool, load_session
from pipeline.files import write_text, writing


def plan(file: Path, session: Path, config: Path, out: Path | None, rrd: Path | None) -> tuple[str, bool]:
    """What the screen says, and whether the passes will do."""
    pool = load_pool(config)
    answer = planned.judge(planned.load_plan(file), pool, load_session(session))
    said = planned.table(answer, pool.verdict)
    if out is not None:
        write_text(out, yaml.safe_dump(planned.as_plain(answer), sort_keys=False))
    if rrd is not None:
        from stages.views.plan import save_plan

        with writing(rrd):
            save_plan(answer, said, rrd)
    return said, planned.is_enough(answer, pool.verdict)
