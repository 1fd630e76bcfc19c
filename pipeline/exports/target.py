"""What a target is: a program, the form in which it takes a mount, and the way back."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from pipeline.config.session import Calibrated
from pipeline.errors import ConfigError
from pipeline.exports.convention import Convention
from pipeline.exports.mounting import Mounting
from pipeline.exports.orders import ORDERS
from pipeline.mount import Mounted

Read = Callable[["Target", str, str, "Options"], Mounted]
Write = Callable[["Target", Mounting, "Options"], str]
CountsFrom = Literal["vessel", "ins", "water"]
SERIAL = re.compile(r"[A-Za-z0-9_.-]{1,50}")


@dataclass(frozen=True)
class Options:
    """What the user tells of a program.

    order: its order of rotations, where that is not known; serial: the sonar's serial number; ins_height_m: height of
    the INS's point above the water at rest.
    """

    order: str | None = None
    serial: str | None = None
    ins_height_m: float | None = None


@dataclass(frozen=True)
class Target:
    """A program, and the form in which it takes a mount.

    Attributes
    ----------
    name, title
        The word after ``--to``; the program and its maker.
    writes
        What is written, in a few words.
    suffix
        Suffix of the file.
    convention
        Axes, signs, order, certainty.
    write
        Returns the text for a mount.
    read
        Returns the mount in the vessel's frame from a text; ``str`` is the file, for messages.
    sensor
        The sensor that the program wants; None: the one that the run calibrates.
    counts_from
        "ins": the program counts from the INS itself, so that no other frame can be meant. "water": its vertical
        offsets count from the waterline.
    uses
        Options that it needs or takes beside ``order``.
    has_marks
        Whether the form has a place where a rejected result is marked.
    """

    name: str
    title: str
    writes: str
    suffix: str
    convention: Convention
    write: Write
    read: Read
    sensor: Calibrated | None = None
    counts_from: CountsFrom = "vessel"
    uses: frozenset[str] = frozenset()
    has_marks: bool = True

    def check(self, options: Options) -> None:
        """Raise a ConfigError if an option does not belong to this program, or its value cannot be."""
        if options.order is not None:
            if options.order not in ORDERS:
                raise ConfigError(f"--order {options.order}: is none of {', '.join(ORDERS)} (leftmost is outermost)")
            if self.convention.order is not None:
                raise ConfigError(
                    f"--order {options.order}: {self.name} turns in the order {self.convention.order}; leave --order "
                    "out"
                )
        if options.serial is not None:
            if "serial" not in self.uses:
                raise ConfigError(f"--serial: {self.name} has no place for it; leave it out")
            if not SERIAL.fullmatch(options.serial):
                raise ConfigError(f"--serial {options.serial}: must be letters, digits, '.', '_' or '-'")
        if options.ins_height_m is not None:
            if "ins_height" not in self.uses:
                raise ConfigError(f"--ins-height: {self.name} has no place for it; leave it out")
            if not abs(options.ins_height_m) <= 100.0:
                raise ConfigError(f"--ins-height {options.ins_height_m:g}: must be within ±100 m")

    def check_frame(self, mounting: Mounting) -> None:
        """Raise a ConfigError if the vessel's frame cannot be meant for this program."""
        if self.counts_from == "ins" and not mounting.frame.is_ins:
            raise ConfigError(
                f"--ins-point, --ins-turn: {self.name} counts from the INS itself, in its own axes (for NovAtel: with "
                "RBV = 0); leave them out"
            )
