"""No command: this module turns exceptions into exit statuses, and handles interrupts and closed output streams."""

import gc
import os
import signal
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import typer

from pipeline.artefacts.memory import use_small_heaps
from pipeline.errors import PoolcalError
from pipeline.language.speaking import say
from stages.commands.usage import usage_message

INTERRUPTED = 130  # the exit status that typer returns after Ctrl-C
STOPPED = "poolcal: interrupted; what was complete is kept"
SPEAKERS = ("typer", "click", "rich")  # packages that print the help
interrupts: list[int] = []
ended: list[int] = []  # the exit status, once the process has nothing more to do


def refused(error: PoolcalError, debug: bool) -> int:
    """Print the line of a refusal, with ``debug`` its traceback too, and return the exit status."""
    if debug:
        say(traceback.format_exc().rstrip(), sys.stderr, as_is=True)
    say(f"poolcal: {error}", sys.stderr)
    return 2


def status_of(command: Callable[[], Any], debug: bool) -> int:
    """Call a command and return its exit status. Exceptions end here. ``debug``: show tracebacks of bad input too."""
    try:
        status = int(command() or 0)
        if status == INTERRUPTED:
            say(STOPPED, sys.stderr)
        return status
    except PoolcalError as error:
        return refused(error, debug)
    except typer.TyperException as error:
        say(f"poolcal: {usage_message(error)}", sys.stderr)
        return 2
    except Exception as error:  # anything else is a bug of the program, status 3
        if interrupts:  # a library that was being loaded has raised another error instead
            say(STOPPED, sys.stderr)
            return INTERRUPTED
        if isinstance(error, OSError) and _raised_in(error).startswith(SPEAKERS):
            say(f"poolcal: {_refusal(error)}", sys.stderr)
            return 2
        if isinstance(error, PermissionError) and error.filename is not None:
            say(f"poolcal: {error.filename}: cannot be used ({error.strerror}); correct its permissions", sys.stderr)
            return 2
        say(traceback.format_exc().rstrip(), sys.stderr, as_is=True)
        say("poolcal: this is a bug; please report it with the lines above", sys.stderr)
        return 3


def _raised_in(error: BaseException) -> str:
    """Return the name of the module that raised ``error``."""
    frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
    return str(frames[-1].f_globals.get("__name__", "")) if frames else ""


def _refusal(error: OSError) -> str:
    return f"standard output: cannot be written ({error.strerror}); make room, or send it elsewhere"


def raise_if_interrupted() -> None:
    """Raise KeyboardInterrupt after a Ctrl-C that Python ignored, for example in a destructor."""
    if interrupts:
        raise KeyboardInterrupt


def _interrupted(number: int, _: object) -> None:
    interrupts.append(number)
    raise KeyboardInterrupt


def prepare_process() -> None:
    """Prepare for output and memory: record Ctrl-C, replace closed streams, and escape letters that cannot be encoded.

    The imports make a million objects that stay: to look for garbage at every 700 takes a tenth of a second.
    """
    gc.set_threshold(50_000)
    use_small_heaps()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupted)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by the shell
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115  stays open until the process ends
    for stream in (sys.stdout, sys.stderr):
        reconfigure: Any = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="backslashreplace")


def end_process(status: int) -> None:
    """End the process. Output that can no longer be written is dropped, without a message from Python."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    if status == INTERRUPTED:
        os._exit(status)  # a library that was interrupted could set another status
    ended.append(status)
    sys.exit(status)


def leave() -> None:
    """End the process at once, after all else that waits for its end; main registers it first, so that it comes last.

    Without it Python takes apart a million objects of the libraries, one by one: half a second.
    """
    if ended:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(ended[-1])
