"""How often a test tries what it tries: a little in every run of the suite, more by ``make thorough``."""

import os
from typing import TypeVar

T = TypeVar("T")
THOROUGH = os.environ.get("POOLCAL_THOROUGH") == "1"


def often(usual: T, thorough: T) -> T:
    return thorough if THOROUGH else usual
