"""A process that draws: ``python -P -m stages.commands.draw_worker RUN NAME...``.

It draws what is named, prints what went wrong as one line of JSON, and ends. Its standard input is a pipe which the
process that started it holds open: the pipe ends when that process does.
"""

import json
import os
import sys
import threading
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from stages.commands.one_drawing import draw_one


def main(run: Path, names: Sequence[str]) -> None:
    """Draw page and recordings of ``run``, and print the failures."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    failures = [failure for name in names if (failure := draw_one(run, name)) is not None]
    print("\n" + json.dumps([asdict(failure) for failure in failures]), flush=True)


def _end_with_parent() -> None:
    """End this process at once when its parent has ended, were it killed: nobody waits for its answer any more."""
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
