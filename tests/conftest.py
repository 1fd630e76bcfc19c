"""Before anything else imports numpy: pipeline pins BLAS to one thread, as the command line does."""

from collections.abc import Iterator

import pytest

import pipeline  # noqa: F401  for its effect, see above
from tests.support.effort import THOROUGH


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Without ``make thorough`` tests so marked are left out."""
    left = [] if THOROUGH else [item for item in items if item.get_closest_marker("thorough")]
    if left:
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if not item.get_closest_marker("thorough")]


@pytest.fixture(scope="session", autouse=True)
def searches_of_the_same_points() -> Iterator[None]:
    """In a usual run of the suite they are made once; ``make thorough`` searches every time."""
    if THOROUGH:
        yield
        return
    from tests.support.kept_searches import kept_searches  # late: pipeline comes before numpy

    with kept_searches():
        yield
