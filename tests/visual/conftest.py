"""Pages and recordings in a browser and a viewer. Without these programs the tests name what is missing."""

from pathlib import Path

import pytest

from tests.support.places import Told
from tools.pictures import missing

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    why = missing()
    for item in items:
        if why and item.path.is_relative_to(HERE):
            item.add_marker(pytest.mark.skip(reason=why))


@pytest.fixture(scope="session")
def run(undisturbed: tuple[Path, Told]) -> Path:
    return undisturbed[0]
