"""Functions compiled to machine code: once an installation, then loaded from a file, at the first call.

The library numba looks at a function's own file alone to see whether its machine code is out of date. But functions of
other modules, and constants, are part of it. So the name of the code's file holds a digest of them.

Numbers behave as numpy's: x / 0 is infinite, and raises nothing. Functions that are part of others are copied into
them: a call would cost as much as the arithmetic. No formula is reordered (no fastmath).
"""

import hashlib
from collections.abc import Callable, Sequence
from functools import lru_cache, update_wrapper
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar, cast

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

Function = TypeVar("Function", bound=Callable[..., Any])
FOLDER = Path(__file__).parent
LIKE_NUMPY: Any = {"nogil": True, "error_model": "numpy"}
_LOCK = Lock()
_FUNCTIONS: list["_Compiled"] = []


@lru_cache(maxsize=1)
def _sources() -> bytes:
    return b"".join(path.read_bytes() for path in sorted(FOLDER.glob("*.py")))


class _Compiled:
    """A function that is compiled, or its machine code loaded, when it is called first."""

    def __init__(self, function: Callable[..., Any], signature: tuple[Any, ...]) -> None:
        self._function, self._signature = function, signature
        self._code: Callable[..., Any] | None = None
        _FUNCTIONS.append(self)
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        code = self._code
        return self.compile()(*arguments) if code is None else code(*arguments)

    def compile(self) -> Callable[..., Any]:
        """Return the machine code."""
        with _LOCK:
            if self._code is None:
                function = self._function
                numbers = {name: one for name, one in function.__globals__.items() if isinstance(one, (int, float))}
                digest = hashlib.sha256(_sources() + repr(sorted(numbers.items())).encode()).hexdigest()[:12]
                function.__qualname__ = f"{function.__name__}-{digest}"  # part of the name of the code's file
                try:
                    self._code = njit(self._signature, **LIKE_NUMPY, cache=True)(function)
                except RuntimeError:  # no folder for the file may be written
                    self._code = njit(self._signature, **LIKE_NUMPY)(function)
        return self._code


def block(values: NDArray[Any]) -> NDArray[Any]:
    """Return values as one block of memory that may be written, as compiled functions ask for."""
    return np.require(values, values.dtype, ("C", "W"))


def named(cls: type[tuple[Any, ...]], *parts: Any) -> Any:
    """Return numba's type of a named tuple of these parts."""
    if len(set(parts)) == 1:
        return types.NamedUniTuple(parts[0], len(parts), cls)  # type: ignore[no-untyped-call]
    return types.NamedTuple(parts, cls)  # type: ignore[no-untyped-call]


def compiled(arguments: Sequence[Any] | None = None) -> Callable[[Function], Function]:
    """Return a decorator that compiles a function.

    Parameters
    ----------
    arguments : sequence of numba types, optional
        With them the function is compiled for these, and others are refused. Without them it is part of the compiled
        functions that call it.
    """
    signature = tuple(arguments) if arguments is not None else None

    def decorator(function: Function) -> Function:
        if signature is None:
            return cast(Function, njit(**LIKE_NUMPY, forceinline=True)(function))
        return cast(Function, _Compiled(function, signature))

    return decorator


def compile_all() -> None:
    """Compile the functions of all modules that are loaded, so that no run has to."""
    for one in _FUNCTIONS:
        one.compile()
