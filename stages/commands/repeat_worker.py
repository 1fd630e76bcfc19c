"""No command: a process that calibrates sessions for ``poolcal repeat``, one after another.

``python -P -m stages.commands.repeat_worker`` does what :mod:`pipeline.fleet.processes` asks of a process: a request a
line on standard input, an answer a line on standard output, all else on standard error.
"""

import json
import os
import sys
import threading
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import SimpleQueue

from pipeline.config.heads import heads_apart, refuse_several
from pipeline.config.session import Calibrated
from pipeline.config.yaml_file import SESSION_YAML, YamlFile
from pipeline.errors import PoolcalError
from pipeline.fleet.answer import Answer, answer_about
from pipeline.run.results import calibration
from stages.commands import run
from stages.commands.draw import Drawings
from stages.commands.entry import INTERRUPTED, prepare_process, status_of
from stages.commands.run import RunOptions


@dataclass(frozen=True)
class Request:
    """A session to bring up to date."""

    session: str
    config: str
    run: str
    sensor: Calibrated
    executor: str | None
    report: bool
    recordings: bool

    def as_line(self) -> str:
        """Return the request as one line of JSON."""
        return json.dumps(asdict(self))


def answer(request: Request) -> Answer:
    """Calibrate a session with one worker, and return what came out."""
    reasons: list[str] = []
    answers: list[Answer] = []

    def calibrate() -> int:
        folder, session = Path(request.run), Path(request.session)
        options = RunOptions(1, request.executor, Drawings(request.report, request.recordings), overwrite=False)
        try:
            if request.sensor == "mbes":
                _refuse_several_heads(session / SESSION_YAML)
            done = run.calibrate(session, Path(request.config), folder, request.sensor, options)
            result = calibration(folder)
            answers.append(answer_about(result, done.ran, done.not_drawn))
        except PoolcalError as error:
            reasons.append(str(error))
            raise
        except Exception as error:
            reasons.append(f"{type(error).__name__}: {error}".partition("\n")[0])
            raise
        return done.status

    status = status_of(calibrate, debug=False)
    if status == INTERRUPTED:
        raise KeyboardInterrupt
    return answers[0] if answers else Answer(status, reason=reasons[0])


def _refuse_several_heads(path: Path) -> None:
    """Raise a ConfigError if session.yaml lists several heads: the table of many sessions has the mount of one."""
    if path.is_file():  # that it is missing is said by the run
        refuse_several(heads_apart(YamlFile.read(path).content, str(path)), str(path))


def main() -> None:
    """Answer requests until standard input closes, which ends this process at once."""
    prepare_process()
    requests: SimpleQueue[str] = SimpleQueue()
    threading.Thread(target=_read, args=(requests,), daemon=True).start()
    answers = os.dup(1)
    os.dup2(2, 1)  # what is printed goes to standard error, in its order
    try:
        while True:
            line = answer(Request(**json.loads(requests.get()))).as_line()
            for stream in (sys.stdout, sys.stderr):
                stream.flush()
            os.write(answers, f"{line}\n".encode())
    except KeyboardInterrupt:
        os._exit(INTERRUPTED)


def _read(requests: "SimpleQueue[str]") -> None:
    """Put each line of standard input into the queue. End the process when the input closes: nobody waits any more."""
    text = b""
    while piece := os.read(0, 65536):
        *lines, text = (text + piece).split(b"\n")
        for line in lines:
            requests.put(line.decode())
    os._exit(1)


if __name__ == "__main__":
    main()
