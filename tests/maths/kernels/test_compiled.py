"""Compiled code: at the first call, one for all threads, and never that of other constants or other loops."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numba
import numpy as np
import pytest

from pipeline.maths.kernels.compiled import LINE, compiled
from tests.support.roots import ROOT

SOURCE = '''
from pipeline.maths.kernels.compiled import FLOAT, compiled
from folder.inner import inner
FACTOR = {factor}
@compiled((FLOAT,))
def outer(x):
    return FACTOR * inner(x)
'''
INNER = '''
from pipeline.maths.kernels.compiled import compiled
@compiled()
def inner(x):
    return x + {shift}
'''
ASK = """
import sys
from pathlib import Path
from pipeline.maths.kernels import compiled
compiled.FOLDER = Path("folder")
from folder.outer import outer
print(outer(1.0))
"""


def answered(place: Path, factor: float, shift: float) -> float:
    """What a process of its own computes; the sources have the same size and time whatever the numbers."""
    folder = place / "folder"
    folder.mkdir(exist_ok=True)
    for name, text in (("outer.py", SOURCE.format(factor=factor)), ("inner.py", INNER.format(shift=shift))):
        (folder / name).write_text(text)
        os.utime(folder / name, (1e9, 1e9))
    environment = os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{place}", "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", ASK], cwd=place, env=environment, capture_output=True, text=True, check=True
    )
    return float(done.stdout)


def test_other_constants_and_other_inner_loops_are_other_code(tmp_path: Path) -> None:
    assert answered(tmp_path, 2.0, 3.0) == 8.0
    kept = len(list(tmp_path.rglob("*.nbc")))
    assert kept == 1
    assert answered(tmp_path, 2.0, 3.0) == 8.0
    assert len(list(tmp_path.rglob("*.nbc"))) == kept  # loaded, not compiled again
    assert answered(tmp_path, 5.0, 3.0) == 20.0
    assert answered(tmp_path, 2.0, 7.0) == 16.0


def test_many_threads_at_once_compile_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def counted(*words: object, **more: object) -> object:
        calls.append(words)
        return lambda function: function

    @compiled((LINE,))
    def total(values: np.ndarray) -> float:
        return float(values.sum())

    monkeypatch.setattr(numba, "njit", counted)
    with ThreadPoolExecutor(8) as threads:
        found = list(threads.map(total, [np.ones(k) for k in range(20)]))
    assert found == [float(k) for k in range(20)]
    assert len(calls) == 1
