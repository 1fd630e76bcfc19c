"""Before anything else imports numpy: pipeline pins BLAS to one thread, as the command line does."""

from collections.abc import Iterator

import pytest

import pipeline  # noqa: F401  for its effect, see above
from tests.support.effort import THOROUGH
from tests.support.small_session import done, place, right, small, undisturbed

__all__ = ["done", "place", "right", "small", "undisturbed"]
SLOW = (  # files of a quarter of a minute and more: one of them, begun last, would keep one worker while others idle
    "test_check_entry.py", "test_tutorial.py", "test_walls_as_they_are.py", "test_laser.py", "test_two_heads.py",
    "test_stages.py", "test_report.py", "test_repeats.py", "test_found_target.py", "test_target_bottom.py",
)  # fmt: skip


def pytest_configure(config: pytest.Config) -> None:
    """Workers take files in the order that they were collected in, not by the numbers of their tests."""
    config.option.loadscopereorder = False


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Without ``make thorough`` tests so marked are left out. Slow files come first."""
    left = [] if THOROUGH else [item for item in items if item.get_closest_marker("thorough")]
    if left:
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if not item.get_closest_marker("thorough")]
    items.sort(key=lambda item: item.path.name not in SLOW)


@pytest.fixture(scope="session", autouse=True)
def searches_of_the_same_points() -> Iterator[None]:
    """In a usual run of the suite they are made once; ``make thorough`` searches every time."""
    if THOROUGH:
        yield
        return
    from tests.support.kept_searches import kept_searches  # late: it takes half a second

    with kept_searches():
        yield
