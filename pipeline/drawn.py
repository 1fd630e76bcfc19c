"""Whether RUN/report/report.html shows the run as it is now. (Apart from drawing it, which loads a lot.)"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from pipeline import manifest

PAGE = "report.html"
HEAD = 2000  # letters within which the page says what it was drawn from


def drawn_from(done: Mapping[str, manifest.Manifest]) -> str:
    """Of everything that the page shows: it changes whenever a result, a setting or a raw file does."""
    shown = [[stage, one.outputs, one.key.config, one.key.raw] for stage, one in done.items()]
    return hashlib.sha256(json.dumps(shown, sort_keys=True).encode()).hexdigest()


def page_to_draw(run: Path, stages: Sequence[str]) -> bool:
    """Whether the page is missing or shows something else. Stages that do not agree are not drawn together."""
    done = {stage: found for stage in stages if (found := manifest.read(run / stage)) is not None}
    if len(done) < len(stages) or not manifest.consistent(done):
        return False
    path = run / "report" / PAGE
    return not path.is_file() or f'content="{drawn_from(done)}"' not in path.read_text(encoding="utf-8")[:HEAD]
