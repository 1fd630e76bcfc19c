"""Entry sheets: plain text for a person who types the numbers into a program, under the program's own field names.

A sheet has fixed lines ``Field (positive sense): value unit``, so that it can be read back. Its last line is END: a
sheet without it was cut off, perhaps within a number.
"""

import re
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, field

from pipeline.config.session import Calibrated
from pipeline.errors import ConfigError
from pipeline.exports.convention import Convention
from pipeline.exports.explanation import explanation, heading, sigmas_of
from pipeline.exports.mounting import Mounting, sigma_text
from pipeline.exports.reading import ROLES, number, numbers_of, whole_lines, written_for
from pipeline.exports.target import CountsFrom, Options, Read, Target
from pipeline.mount import Mounted

DECIMALS = 4  # of degrees and metres: rounding is below 0.00005 degrees, 0.05 mm
END = "End of sheet."
WIDTH = 120
_LINES = textwrap.TextWrapper(WIDTH, break_on_hyphens=False, break_long_words=False)
_FIELD = re.compile(r"  (?P<field>[^:]*\S): +(?P<value>\S+)(?: .*)?")
Groups = tuple[tuple[str, dict[str, str]], ...]  # title of a group, and its fields by role


def vessel_mount(mounting: Mounting) -> Mounted:
    """Return the mount in the vessel's frame."""
    return mounting.vessel


@dataclass(frozen=True)
class Sheet:
    """The form of a program's sheet.

    groups: the fields of each dialog, by role (x, y, z, roll, pitch, yaw), in the program's order; zeros: what must be
    zero, a sentence; notes: what else to know; extra: further lines, of the mount and its numbers; of: the mount whose
    numbers are written; not_known: by role, words in place of a number that cannot be known.
    """

    groups: Groups
    zeros: str = ""
    notes: tuple[str, ...] = ()
    extra: Callable[[Target, Mounting, Options], list[str]] | None = None
    of: Callable[[Mounting], Mounted] = vessel_mount
    not_known: dict[str, Callable[[Mounting, Options], str | None]] = field(default_factory=dict)

    def target(
        self,
        name: str,
        title: str,
        convention: Convention,
        *,
        writes: str = "entry sheet",
        read: Read | None = None,
        sensor: Calibrated | None = "mbes",
        counts_from: CountsFrom = "vessel",
        uses: frozenset[str] = frozenset(),
    ) -> Target:
        """Return the target whose form is this sheet.

        Parameters
        ----------
        name, title, convention, writes, sensor, counts_from, uses
            As in Target.
        read
            Reads the mount from a text; None: from the sheet's fields.
        """
        return Target(
            name=name,
            title=title,
            writes=writes,
            suffix=".txt",
            convention=convention,
            write=self.write,
            read=read or self.read,
            sensor=sensor,
            counts_from=counts_from,
            uses=uses,
        )

    def write(self, target: Target, mounting: Mounting, options: Options) -> str:
        """Return the sheet's text."""
        values = target.convention.numbers(self.of(mounting), options.order).by_role()
        sigmas = sigmas_of(target, mounting, options)
        senses = target.convention.words()
        lines = heading(target, mounting)
        for title, fields in self.groups:
            lines += ["", title]
            for role, name in fields.items():
                unit = "m" if role in ("x", "y", "z") else "°"
                label = f"{name} ({senses[role]}):"
                in_words = self.not_known[role](mounting, options) if role in self.not_known else None
                value = f"{written_for(target.convention, role, values[role], DECIMALS):>10} {unit}"
                if in_words is not None:
                    value = f"  {in_words}"
                lines.append(f"  {label:<58}{value}   {sigma_text(sigmas, role)}".rstrip())
        if self.extra is not None:
            lines += ["", *self.extra(target, mounting, options)]
        sentences = [*explanation(target, mounting, options, self.zeros), *self.notes]
        lines += ["", *(line for sentence in sentences for line in _LINES.wrap(sentence)), END]
        return "\n".join(lines) + "\n"

    def read(self, target: Target, text: str, where: str, options: Options) -> Mounted:
        """Return the mount in the vessel's frame from a sheet's text; ``where``: the file."""
        lines = whole_lines(text, where)
        if not lines or not lines[0].startswith("poolcal export: ") or f"({target.name})" not in lines[0]:
            raise ConfigError(f"{where}: is no sheet of poolcal export --to {target.name}; name one")
        if lines[-1] != END:
            raise ConfigError(f"{where}: does not end with '{END}': it was cut off; export it again")
        found: dict[str, list[str]] = {}
        for line in lines:
            match = _FIELD.fullmatch(line)
            if match:
                found.setdefault(match["field"].partition(" (")[0], []).append(match["value"])
        names = {role: name for _, fields in self.groups for role, name in fields.items()}
        values = {}
        for role in ROLES:
            given = found.get(names[role], [])
            if len(given) != 1:
                reason = "is missing" if not given else f"is there {len(given)} times"
                raise ConfigError(f"{where}: {names[role]}: {reason}; export the sheet again")
            values[role] = number(given[0], names[role], where)
        return target.convention.mounted(numbers_of(values), options.order)
