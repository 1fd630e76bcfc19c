"""The tree of errors that a user can cause, and correct.

PoolcalError                    every one ends as one line on standard error and status 2
├── ConfigError                 a YAML file or an option: names file, key, value and remedy
├── RawDataError                an instrument's file: names file, place, value and remedy
├── ArtefactError               a run folder's table: missing, damaged, locked, not writable
├── DegenerateGeometryError     data from which the asked-for quantity does not follow
└── NotConvergedError           an iteration without which nothing can follow did not end

Anything else that is raised is a bug: it keeps its traceback and ends with status 3. Weak geometry and iterations
that merely give a poor calibration are results (a rejected verdict, status 1), never errors.
"""


class PoolcalError(Exception):
    """A mistake outside the program. The message is one line: what, where, the value, what to do."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))


class ConfigError(PoolcalError):
    """A configuration that cannot be meant."""


class RawDataError(PoolcalError):
    """An instrument file that cannot be used."""


class ArtefactError(PoolcalError):
    """A run folder or a table in it that cannot be read, written or trusted."""


class DegenerateGeometryError(PoolcalError):
    """Too few points, or points in a constellation from which the quantity does not follow."""


class NotConvergedError(PoolcalError):
    """An iteration on which everything later depends did not end."""
