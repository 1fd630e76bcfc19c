"""Say where the time of a run goes: by stage, the functions of the program in which its threads were found.

A thread looks every few milliseconds at all others and counts, for each, the innermost function of the program in its
stack. A thread that waits for others does not count. What a function asks of a library (of pyarrow, of numpy) counts as
its own, and so does the decoding of LAZ, for which ingest waits at a pipe.

    python -m tools.profile_run SESSION [--jobs 2] [--least 2]
"""

import argparse
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from types import FrameType, ModuleType

from pipeline.run import runner
from pipeline.run.workers import workers
from stages import load
from stages.commands.entry import prepare_process

ROOT = Path(__file__).resolve().parents[1]
STEP_S = 0.004
WAITING = {"_wait", "_ordered", "map"}  # functions of run/workers.py in which a thread has nothing to do


class Sampler(threading.Thread):
    """Counts of functions since the last call of :meth:`taken`."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self._counts: Counter[str] = Counter()

    def run(self) -> None:
        """Look at all other threads, again and again."""
        while True:
            for thread, frame in sys._current_frames().items():
                if thread != self.ident and (name := innermost(frame)):
                    self._counts[name] += 1
            time.sleep(STEP_S)

    def taken(self) -> Counter[str]:
        """Return the counts, and begin anew."""
        counts, self._counts = self._counts, Counter()
        return counts


def innermost(frame: FrameType | None) -> str:
    """Return the innermost function of the program in a stack; empty if there is none, or if it waits."""
    while frame is not None:
        path, name = Path(frame.f_code.co_filename), frame.f_code.co_name
        if path.is_relative_to(ROOT) and path.parts[len(ROOT.parts)] in ("pipeline", "stages"):
            if path.name == "workers.py" and name in WAITING:
                return ""
            if not (path.name == "compiled.py" and name == "__call__"):
                return f"{path.relative_to(ROOT).with_suffix('').as_posix()}: {name}"
        frame = frame.f_back
    return ""


def main() -> None:
    """Run a session, and print the shares."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("session", type=Path)
    parser.add_argument("--jobs", type=int, default=2, help="number of workers; default: 2")
    parser.add_argument("--least", type=float, default=2.0, help="smallest share, per cent of a stage; default: 2")
    options = parser.parse_args()
    prepare_process()
    modules: tuple[ModuleType, ...] = load()
    found: dict[str, tuple[float, Counter[str]]] = {}
    with tempfile.TemporaryDirectory() as place, workers(options.jobs, None) as pool:
        sampler, last = Sampler(), time.perf_counter()
        sampler.start()

        def finished(stage: str) -> None:
            nonlocal last
            now = time.perf_counter()
            found[stage], last = (now - last, sampler.taken()), now

        session = options.session
        runner.run(modules, session, session / "pool.yaml", Path(place) / "run", workers=pool, finished=finished)
    whole = sum(counts.total() for _, counts in found.values())
    for stage, (seconds, counts) in found.items():
        print(f"{stage}: {seconds:.2f} s, {100 * counts.total() / whole:.0f} % of the threads' time")
        for name, count in counts.most_common():
            if 100 * count >= options.least * counts.total():
                print(f"  {100 * count / counts.total():5.1f} %  {name}")


if __name__ == "__main__":
    main()
