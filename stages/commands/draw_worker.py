"""No command: a worker process that draws, ``python -P -m stages.commands.draw_worker RUN NAME...``.

The process makes the drawings with these names, prints the failures as one line of JSON, and ends. Its standard input
is a pipe that its parent process keeps open. The pipe closes when the parent ends.
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
    """Make the drawings ``names`` of ``run``, and print the failures."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    failures = [failure for name in names if (failure := draw_one(run, name)) is not None]
    print("\n" + json.dumps([asdict(failure) for failure in failures]), flush=True)


def _end_with_parent() -> None:
    """End this process as soon as its parent has ended or was killed: no process waits for the answer any more."""
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
