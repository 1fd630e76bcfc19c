"""Functions compiled to machine code: once an installation, then loaded from a file."""

from collections.abc import Callable, Sequence
from typing import Any, TypeVar, cast

from numba import njit, types



def arrays(dtype: Any, dimensions: int, *, written: bool = False) -> Any:
    """Return the type of contiguous arrays; those that are not written may be read-only, as Arrow's are."""
    return types.Array(dtype, dimensions, "C", readonly=not written)


Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(arguments: Sequence[Any] | None = None) -> Callable[[Function], Function]:
    """Return a decorator that compiles a function.

    Parameters
    ----------
    arguments : sequence of numba types, optional
        With them the function is compiled when its module is imported, and others are refused. Without them it is part
        of the compiled functions that call it.
    """
    signature = tuple(arguments) if arguments is not None else None

    def decorator(function: Function) -> Function:
        if signature is None:
            return cast(Function, njit(nogil=True)(function))
        try:
            return cast(Function, njit(signature, nogil=True, cache=True)(function))
        except RuntimeError:  # no folder for the file may be written
            return cast(Function, njit(signature, nogil=True)(function))

    return decorator
