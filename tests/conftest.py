"""Before anything else imports numpy: pipeline pins BLAS to one thread, as the command line does."""

import pytest

import pipeline  # noqa: F401  for its effect, see above
from tests.support.effort import THOROUGH


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Without ``make thorough`` tests so marked are left out."""
    left = [] if THOROUGH else [item for item in items if item.get_closest_marker("thorough")]
    if left:
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if not item.get_closest_marker("thorough")]
