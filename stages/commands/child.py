"""No command: how processes of this program are started that run one of its modules."""

import os
import sys
from pathlib import Path

PYTHON = (sys.executable, "-P", "-m")  # -P: nothing is imported from the working folder


def environment() -> dict[str, str]:
    """Return this process's environment, with the program's root first in PYTHONPATH in case it is not installed."""
    root = str(Path(__file__).parents[2])
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    return os.environ | {"PYTHONPATH": path}
