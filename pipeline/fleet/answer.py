"""What a process says of the session that it was given, and what its end means if it says nothing."""

import json
import signal
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from pipeline.console import plural
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.report.reason_codes import verdict_of

ACCEPTED, REJECTED, COULD_NOT_RUN, BUG = range(4)  # the exit statuses of poolcal run
INTERRUPTED = 130  # exit code of a process after SIGINT
ENDED_FROM_OUTSIDE = (signal.SIGKILL, signal.SIGTERM, signal.SIGHUP)


@dataclass(frozen=True)
class Answer:
    """What came out of one session.

    Attributes
    ----------
    status
        ACCEPTED, REJECTED, COULD_NOT_RUN or BUG.
    ran
        The names of the stages that were run, in order.
    reason
        One line on why there is no accepted calibration; else empty.
    verdict
        The verdict in words.
    mount
        The calibrated settings by name, degrees and m, if they may be used.
    not_drawn
        The kinds of drawings that failed.
    """

    status: int
    ran: list[str] = field(default_factory=list)
    reason: str = ""
    verdict: str = ""
    mount: dict[str, float] = field(default_factory=dict)
    not_drawn: list[str] = field(default_factory=list)

    def as_line(self) -> str:
        """Return the answer as one line of JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def from_line(cls, line: str) -> "Answer":
        """Return the answer that a line holds."""
        return cls(**json.loads(line))


def answer_about(result: Mapping[str, Any], ran: list[str], not_drawn: list[str]) -> Answer:
    """Return the answer about a finished calibration.

    Parameters
    ----------
    result
        The content of calibration.json. Of a rejected calibration no value may be used; of one accepted in part, only
        those that are good enough.
    ran, not_drawn
        As in Answer.
    """
    held, reasons = result.get("held", {}), result["reasons"]
    verdict = verdict_of(result).partition(":")[0]  # the mount shows which values
    if result["verdict"] != "accepted":
        more = f"; and {plural(len(reasons) - 1, 'other reason')}" if len(reasons) > 1 else ""
        return Answer(REJECTED, ran, reasons[0] + more, verdict, not_drawn=not_drawn)
    mount = result[result.get("calibrated", "mbes")]["mount"] or {}
    good = {key: float(mount[key]) for name, _, key, _ in PARAMETERS if key in mount and name not in held}
    return Answer(ACCEPTED, ran, verdict=verdict, mount=good, not_drawn=not_drawn)


def answer_of_ended(exit_code: int) -> Answer:
    """Return the answer about a session whose process ended without one.

    Parameters
    ----------
    exit_code
        The exit code of the process, or minus the number of the signal that ended it.
    """
    if exit_code == INTERRUPTED:
        return Answer(COULD_NOT_RUN, reason="its process was interrupted; run again")
    if exit_code >= 0:
        return Answer(BUG, reason=f"its process ended with status {exit_code}")
    number = signal.Signals(-exit_code) if -exit_code in list(signal.Signals) else None
    name = number.name if number is not None else f"signal {-exit_code}"
    if number in ENDED_FROM_OUTSIDE:
        return Answer(
            COULD_NOT_RUN, reason=f"its process was ended from outside ({name}); is memory short? Run again, --jobs 1"
        )
    return Answer(BUG, reason=f"its process crashed ({name})")


def overall_status(answers: list[Answer]) -> int:
    """Return the exit status for all sessions: 3 after a bug, else 2, 1 or 0 by the worst of them."""
    return max(answer.status for answer in answers)
