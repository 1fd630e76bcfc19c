"""The same toy session as the runner's tests have, and the command line with toy stages in this process."""

import sys
from collections.abc import Callable

import pytest

import stages.commands.run
import stages.commands.stage  # noqa: F401  loaded before there are toys, of which they would keep some after the test
from tests.run.conftest import pool
from tests.support import toy_poolcal
from tests.support.places import Told, poolcal

__all__ = ["pool"]


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Told]:
    """A second for each start is saved where it does not matter that the command is a process of its own."""
    for name, module in toy_poolcal.install(monkeypatch.setattr).items():
        monkeypatch.setitem(sys.modules, name, module)
    return poolcal
