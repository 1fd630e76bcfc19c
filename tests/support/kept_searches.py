"""The searches of stage segment, each made once for the same question: most tests calibrate one of three sessions."""

import functools
import hashlib
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

import stages.segment

SEARCHES = ("search_target_pose", "search_mount")


def _once(search: Callable[..., Any]) -> Callable[..., Any]:
    """The same function, which keeps its answers by all bytes of its arguments. Nobody changes an answer."""
    answers: dict[bytes, Any] = {}

    @functools.wraps(search)
    def answer(*question: Any) -> Any:
        key = hashlib.sha256(pickle.dumps(question)).digest()
        if key not in answers:
            answers[key] = search(*question)
        return answers[key]

    return answer


@contextmanager
def kept_searches() -> Iterator[None]:
    """They take half of a small calibration. An answer is that of this process: others search for themselves."""
    with pytest.MonkeyPatch.context() as patched:
        for name in SEARCHES:
            patched.setattr(stages.segment, name, _once(getattr(stages.segment, name)))
        yield
