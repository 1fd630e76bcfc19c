"""Processes that answer requests, several at a time. One that crashes or is killed takes its own request with it alone.

A process reads requests from its standard input, one a line, and writes one line to its standard output for each;
everything that it writes to standard error belongs to the request that it works on. A process goes on with the next
request as long as its answers are good; otherwise another one is started, for its state is in doubt. Its standard input
is a pipe that closes when this process ends, by whatever cause; then it must end too.

Ctrl-C does not reach the processes: this process interrupts them, and kills those that do not end.
"""

import contextlib
import os
import signal
import subprocess
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import wait

from pipeline.errors import ArtefactError

PATIENCE_S = 10.0  # time for an interrupted process to remove what it has half written


@dataclass(frozen=True)
class Command:
    """The command of the processes, and their environment."""

    words: Sequence[str]
    environment: Mapping[str, str]


@dataclass(frozen=True)
class Reply:
    """The answer to a request.

    Attributes
    ----------
    line
        The line that the process wrote; None if it ended without one.
    exit_code
        Then its exit code, or minus the number of a signal.
    said
        What it wrote to standard error.
    seconds
        Time from the request to the answer.
    """

    line: str | None
    exit_code: int
    said: str
    seconds: float


@dataclass
class _Process:
    """A process with the request that it works on."""

    process: "subprocess.Popen[bytes]"
    request: int = -1
    start: float = 0.0
    line: bytearray = field(default_factory=bytearray)
    said: bytearray = field(default_factory=bytearray)

    @classmethod
    def started(cls, command: Command) -> "_Process":
        pipe = subprocess.PIPE
        process = subprocess.Popen(
            command.words, stdin=pipe, stdout=pipe, stderr=pipe, env=command.environment, start_new_session=True
        )
        for stream in (process.stdout, process.stderr):
            os.set_blocking(_number(stream), False)
        return cls(process)

    def give(self, number: int, request: str) -> None:
        """Begin with a request. If the process has ended meanwhile, this shows when its answer is read."""
        self.request, self.start = number, time.perf_counter()
        self.line.clear()
        self.said.clear()
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):
            self.process.stdin.write(request.encode() + b"\n")
            self.process.stdin.flush()

    def reply(self) -> Reply | None:
        """Return the reply, if the process has answered or ended; otherwise read what it has written so far."""
        ended = _drain(_number(self.process.stdout), self.line)
        answered = self.line.endswith(b"\n")
        if ended and not answered:
            self.process.kill()  # has no effect on one that is ending
            self.process.wait()
        _drain(_number(self.process.stderr), self.said)
        if not (ended or answered):
            return None
        line = self.line.decode() if answered else None
        seconds = time.perf_counter() - self.start
        return Reply(line, self.process.returncode or 0, self.said.decode("utf-8", "replace"), seconds)

    def end(self) -> None:
        """Kill the process, unless it has ended already, and close its pipes."""
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self.process.stderr):
            with contextlib.suppress(OSError):
                stream.close()  # type: ignore[union-attr]  # a pipe is there


def ask_all(
    command: Command,
    requests: Sequence[str],
    jobs: int,
    begun: Callable[[int], None],
    replied: Callable[[int, Reply], bool],
) -> None:
    """Give every request to a process, in order, ``jobs`` at a time.

    Parameters
    ----------
    command
        The command of the processes.
    requests
        The requests, one line each.
    jobs
        The largest number of processes at a time.
    begun
        Function that is called with the number of a request when a process begins with it.
    replied
        Function that is called with the number of a request and its reply, when it has come. It returns whether the
        process may go on with another request.
    """
    waiting = deque(enumerate(requests))
    busy: list[_Process] = []
    idle: list[_Process] = []
    try:
        while waiting or busy:
            while waiting and len(busy) < jobs:
                one = _next(idle) or _started(command, bool(busy))
                if one is None:
                    break
                busy.append(one)
                number, request = waiting.popleft()
                begun(number)
                one.give(number, request)
            wait([_number(stream) for one in busy for stream in (one.process.stdout, one.process.stderr)])
            for one in list(busy):
                reply = one.reply()
                if reply is not None:
                    busy.remove(one)
                    idle.append(one)
                    if not replied(one.request, reply):
                        idle.pop().end()
    finally:
        _end(busy, idle)


def _next(idle: list[_Process]) -> _Process | None:
    """Return a process that waits for a request and is alive; None if there is none."""
    while idle:
        one = idle.pop()
        if one.process.poll() is None:
            return one
        one.end()
    return None


def _started(command: Command, others: bool) -> _Process | None:
    """Start a process. If this is not possible, return None if there are ``others``, which can go on without it."""
    try:
        return _Process.started(command)
    except OSError as error:
        if others:
            return None
        raise ArtefactError(f"no process can be started ({error.strerror}); end others and run again") from error


def _end(busy: Sequence[_Process], idle: Sequence[_Process]) -> None:
    """Interrupt the busy processes, wait for their ends, and kill what is left after PATIENCE_S, or a second Ctrl-C."""
    try:
        for one in busy:
            one.process.send_signal(signal.SIGINT)
        deadline = time.monotonic() + PATIENCE_S
        for one in busy:
            with contextlib.suppress(subprocess.TimeoutExpired):
                one.process.wait(max(0.0, deadline - time.monotonic()))
    finally:
        for one in (*busy, *idle):
            one.end()


def _drain(number: int, into: bytearray) -> bool:
    """Read from a pipe whatever is in it; return whether its other end is closed."""
    while True:
        try:
            piece = os.read(number, 65536)
        except BlockingIOError:
            return False
        if not piece:
            return True
        into += piece


def _number(stream: object) -> int:
    """Return the number of a pipe's file descriptor."""
    return int(stream.fileno())  # type: ignore[attr-defined]  # a pipe is there, although Popen's type says: perhaps
