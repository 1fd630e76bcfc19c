"""``poolcal plan``: passes judged before they are sailed, on the screen, as YAML and as a recording."""

from pathlib import Path

import yaml

from pipeline import planned
from pipeline.errors import ConfigError
from pipeline.files import write_text, writing
from pipeline.folder import load_settings


def plan(file: Path, session: Path, config: Path, out: Path | None, rrd: Path | None) -> tuple[str, bool]:
    """What the screen says, and whether the passes will do."""
    settings = load_settings(session, config)
    pool, wanted = settings.pool, planned.load_plan(file, settings.session)
    _refuse_over(out)
    answer = planned.judge(wanted, pool, settings.session)
    said = planned.table(answer, pool.verdict)
    if out is not None:
        write_text(out, yaml.safe_dump(planned.as_plain(answer), sort_keys=False))
    if rrd is not None:
        from stages.views.plan import save_plan

        with writing(rrd):
            save_plan(answer, said, rrd)
    return said, planned.is_enough(answer, pool.verdict)


def _refuse_over(out: Path | None) -> None:
    """An earlier prediction is replaced; a plan, a config or a run's settings never."""
    if out is None or not out.is_file():
        return
    if not out.read_bytes().startswith(b"given:"):
        raise ConfigError(f"--yaml {out}: is there and no prediction of poolcal plan; name another file")
