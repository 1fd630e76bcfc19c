"""The tree of errors that a user can cause and correct.

PoolcalError                    each ends the program with one line on standard error and status 2
├── ConfigError                 a YAML file or an option: the message names file, key, value and remedy
├── RawDataError                an instrument's file: the message names file, place, value and remedy
├── ArtefactError               a run folder or its table: missing, damaged, locked, not writable
├── DegenerateGeometryError     data that do not determine the wanted quantity
└── NotConvergedError           an iteration that did not converge, and whose result is necessary

Every other exception is a bug: it keeps its traceback, and the program ends with status 3. Weak geometry, and an
iteration that only makes the calibration poor, are results (a rejected verdict, status 1), never errors.
"""


class PoolcalError(Exception):
    """A mistake outside the program. Its message is one line: the mistake, its place, the value, and the remedy."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))


class ConfigError(PoolcalError):
    """A configuration that is not valid."""


class RawDataError(PoolcalError):
    """An instrument file that cannot be used."""


class ArtefactError(PoolcalError):
    """A run folder or a table in it that cannot be read, written or trusted."""


class DegenerateGeometryError(PoolcalError):
    """Too few points, or points whose arrangement does not determine the wanted quantity."""


class NotConvergedError(PoolcalError):
    """An iteration that did not converge, although all later steps need its result."""
