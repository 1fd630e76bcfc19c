"""The heap from which Arrow takes its memory: the one that keeps little, if nobody has chosen another."""

import os
import subprocess
import sys

import pytest

PROGRAM = """
from stages.commands.entry import prepare_process
prepare_process()
import pyarrow
print(pyarrow.default_memory_pool().backend_name)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="Arrow's builds for other systems may lack jemalloc")
@pytest.mark.parametrize(("chosen", "used"), [({}, "jemalloc"), ({"ARROW_DEFAULT_MEMORY_POOL": "system"}, "system")])
def test_arrow_uses_the_heap_that_keeps_little(chosen: dict[str, str], used: str) -> None:
    others = {name: value for name, value in os.environ.items() if name != "ARROW_DEFAULT_MEMORY_POOL"}
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=others | chosen, capture_output=True, text=True, check=True
    )
    assert (run.stdout.strip(), run.stderr) == (used, "")
