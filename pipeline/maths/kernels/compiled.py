"""Functions compiled to machine code: once an installation, then loaded from a file, at the first call.

The library numba looks at a function's own file alone to see whether its machine code is out of date. But functions of
other modules, and constants, are part of it. So the name of the code's file holds a digest of them. numba itself is
imported at the first call, because many commands call no such function.

Numbers behave as numpy's: x / 0 is infinite, and raises nothing. Functions that are part of others are copied into
them: a call would cost as much as the arithmetic. No formula is reordered (no fastmath). Functions make no arrays: what
they write, and scratch memory, are arguments. So numba need not count references to arrays (``_nrt``), which takes
longer than the arithmetic of a loop whose parts look at rows of arrays.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, update_wrapper
from pathlib import Path
from threading import RLock
from types import FunctionType
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

Function = TypeVar("Function", bound=Callable[..., Any])
FOLDER = Path(__file__).parent
OPTIONS: Any = {"nogil": True, "error_model": "numpy", "_nrt": False}
_LOCK = RLock()
_FUNCTIONS: list["_Compiled"] = []


@dataclass(frozen=True)
class Block:
    """Type of an argument: an array in one block of memory, or a number if it has no axis."""

    kind: str  # numba's name of the type of its numbers
    axes: int = 0

    def numba_type(self) -> Any:
        """Return numba's type."""
        from numba import types

        kind = getattr(types, self.kind)
        return types.Array(kind, self.axes, "C") if self.axes else kind


@dataclass(frozen=True)
class Named:
    """Type of an argument: a named tuple ``of`` these parts."""

    of: type[tuple[Any, ...]]
    parts: tuple["Block | Named", ...]

    def numba_type(self) -> Any:
        """Return numba's type."""
        from numba import types

        parts = tuple(part.numba_type() for part in self.parts)
        if len(set(parts)) == 1:
            return types.NamedUniTuple(parts[0], len(parts), self.of)  # type: ignore[no-untyped-call]
        return types.NamedTuple(parts, self.of)  # type: ignore[no-untyped-call]


FLOAT, INTEGER, FLAG = Block("float64"), Block("int64"), Block("boolean")
LINE, MATRIX, CUBE, CUBES = (Block("float64", axes) for axes in (1, 2, 3, 4))
NUMBERS, FLAGS = Block("int64", 1), Block("boolean", 1)


def named(of: type[tuple[Any, ...]], *parts: Block | Named) -> Named:
    """Return the type of a named tuple of these parts."""
    return Named(of, parts)


def block(values: NDArray[Any]) -> NDArray[Any]:
    """Return values as one block of memory that may be written, as compiled functions ask for."""
    return np.require(values, values.dtype, ("C", "W"))


def compiled(arguments: Sequence[Block | Named] | None = None) -> Callable[[Function], Function]:
    """Return a decorator that compiles a function.

    Parameters
    ----------
    arguments : sequence of Block or Named, optional
        With them the function is compiled for these, and others are refused. Without them it is part of the compiled
        functions that call it.
    """

    def decorator(function: Function) -> Function:
        if arguments is None:
            return cast(Function, _Part(function))
        return cast(Function, _Compiled(function, tuple(arguments)))

    return decorator


def compile_all(first: int = 0, step: int = 1) -> None:
    """Compile every ``step``-th function of all loaded modules, from number ``first``, so that no run has to."""
    for one in _FUNCTIONS[first::step]:
        one.compile()


class _Part:
    """A function that is copied into the compiled functions that call it."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function
        self._to_copy: Any = None
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        return self.function(*arguments)

    def to_copy(self) -> Any:
        """Return the function as numba copies it."""
        from numba import njit

        if self._to_copy is None:
            self._to_copy = njit(**OPTIONS, forceinline=True)(_with_parts(self.function))
        return self._to_copy


class _Compiled:
    """A function that is compiled, or its machine code loaded, when it is called first."""

    def __init__(self, function: Callable[..., Any], arguments: tuple[Block | Named, ...]) -> None:
        self._function, self._arguments = function, arguments
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
                from numba import njit

                function = _with_parts(self._function)
                digest = hashlib.sha256(_sources() + repr(_constants(self._function)).encode()).hexdigest()[:12]
                function.__qualname__ = f"{function.__name__}-{digest}"  # part of the name of the code's file
                signature = tuple(argument.numba_type() for argument in self._arguments)
                try:
                    self._code = njit(signature, **OPTIONS, cache=True)(function)
                except RuntimeError:  # no folder for the file may be written
                    self._code = njit(signature, **OPTIONS)(function)
        return self._code


def _with_parts(function: Callable[..., Any]) -> FunctionType:
    """Return the function with the names of its parts bound to what numba copies."""
    parts = {name: function.__globals__.get(name) for name in function.__code__.co_names}
    known = {name: part.to_copy() for name, part in parts.items() if isinstance(part, _Part)}
    names = function.__globals__ | known
    return FunctionType(function.__code__, names, function.__name__, function.__defaults__, function.__closure__)


def _constants(function: Callable[..., Any]) -> list[tuple[str, float]]:
    """Return the names and values of the numbers that the function's module, and those of its parts, know."""
    modules = [function.__globals__]
    for known in modules:  # grows
        parts = [value.function.__globals__ for value in known.values() if isinstance(value, _Part)]
        modules += [other for other in parts if not any(other is one for one in modules)]
    return sorted({item for known in modules for item in known.items() if isinstance(item[1], (int, float))})


@lru_cache(maxsize=1)
def _sources() -> bytes:
    return b"".join(path.read_bytes() for path in sorted(FOLDER.glob("*.py")))
