"""Whatever the bytes, readers end, and end with rows that make sense or with one line of advice."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pipeline.errors import PoolcalError
from pipeline.readers.detect import HEAD_BYTES, kind_of_bytes
from tests.support.effort import often
from tests.support.files import build, sonar_files
from tests.support.files.whole_files import WHOLE

WEEK_NS = 604_800 * 10**9
OPTIONS = {"deadline": None, "suppress_health_check": list(HealthCheck), "derandomize": True, "database": None}
EXAMPLES = {"laz": 15, "e57": 10}  # each in a process of its own


def check(sensor: str, kind: str, content: bytes) -> None:
    """Reads the bytes as a file of that format: sound rows, or a known error of one line."""
    more: dict[str, Any] = {"gps_week": build.WEEK} if sensor != "mbes" else {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "data.bin"
        path.write_bytes(content)
        try:
            columns, dropped = build.read(sensor, path, kind, **more)
        except PoolcalError as error:
            assert "\n" not in str(error)
            assert "data.bin" in str(error) or "session.yaml" in str(error)
            return
    assert all(isinstance(number, int) and number > 0 for number in dropped.values())
    for name, values in columns.items():
        assert np.all(np.isfinite(values)), name
    if columns:
        assert columns["t_ns"].dtype == np.int64
        assert np.all((columns["t_ns"] > 900 * WEEK_NS) & (columns["t_ns"] < 5002 * WEEK_NS))
    if sensor == "ins" and columns:
        assert np.all(np.diff(columns["t_ns"]) > 0)
        assert np.all((columns["azimuth_rad"] >= 0) & (columns["azimuth_rad"] <= 2 * np.pi))


def mutated(whole: bytes) -> st.SearchStrategy[bytes]:
    """A file with some bytes overwritten, some cut out, some put in."""
    place = st.integers(0, len(whole))
    marks = [bytes(8), b"\xff" * 8, b"BTH0", b"\xaaD\x12\x1c", b"\xaaD\x13", b"\n"]
    marks += [b"#MRZ", b"\0\0\0\2", b"\0\2N", b"\3"]
    piece = st.binary(max_size=40) | st.sampled_from(marks)
    edit = st.tuples(place, st.integers(0, 60), piece)

    def apply(edits: list[tuple[int, int, bytes]]) -> bytes:
        content = whole
        for at, length, new in edits:
            content = content[:at] + new + content[at + length :]
        return content

    return st.lists(edit, min_size=1, max_size=4).map(apply)


def overwritten(whole: bytes) -> st.SearchStrategy[bytes]:
    """A file of the same length with one to four numbers changed: lengths, counts, offsets, scales."""
    numbers = [bytes(4), b"\xff" * 4, b"\xff\xff\xff\x7f", b"\1\0\0\0", b"\0\0\0\1"]
    numbers += [bytes(6) + b"\xf0\x7f", bytes(6) + b"\xf8\x7f"]  # infinity, not a number
    edit = st.tuples(st.integers(0, len(whole) - 8), st.sampled_from(numbers) | st.binary(min_size=1, max_size=8))

    def apply(edits: list[tuple[int, bytes]]) -> bytes:
        content = bytearray(whole)
        for at, new in edits:
            content[at : at + len(new)] = new
        return bytes(content)

    return st.lists(edit, min_size=1, max_size=4).map(apply)


@pytest.mark.parametrize("how", [mutated, overwritten])
@pytest.mark.parametrize("form", WHOLE)
def test_damaged_files(form: str, how: Callable[[bytes], st.SearchStrategy[bytes]]) -> None:
    sensor, kind, whole = WHOLE[form]

    @settings(max_examples=often(EXAMPLES.get(form, 80) // 3, EXAMPLES.get(form, 80)), **OPTIONS)
    @given(how(whole))
    def damaged(content: bytes) -> None:
        check(sensor, kind, content)

    damaged()


STARTS = [b"", b"LASF", b"PAR1", b"\x7b" + bytes(1023), b"BTH0", b"\xaaD\x12\x1c", b"\xaaD\x13X", b"#INSPVAA,"]
STARTS += [b"gps_ns,x_m\n", b"Week GPSTime Latitude Longitude H-Ell Roll Pitch Heading\n"]
STARTS += [sonar_files.all_installation(), sonar_files.all_installation()[:20]]
STARTS += [b"ASTM-E57\1\0\0\0", b"\0\0\0\x0c\0\0\0\1GSF-v03.06\0\0", b"\xff\0\0\0#MRZ"]
FORMATS = sorted({pair[:2] for pair in WHOLE.values()})


@settings(max_examples=often(60, 150), **OPTIONS)
@given(st.sampled_from(FORMATS), st.sampled_from(STARTS), st.binary(max_size=3000))
def test_random_bytes(how: tuple[str, str], start: bytes, content: bytes) -> None:
    check(*how, start + content)


@settings(max_examples=often(120, 300), **OPTIONS)
@given(st.sampled_from(STARTS), st.binary(max_size=600) | st.text(max_size=300).map(str.encode), st.integers(1, 2**40))
def test_every_content_is_of_some_kind(start: bytes, content: bytes, size: int) -> None:
    head = (start + content)[:HEAD_BYTES]
    kind = kind_of_bytes(head, max(size, len(head)) if head else 0)
    assert kind.title
    assert kind.advice or (kind.format and kind.sensors)


@settings(max_examples=often(40, 100), **OPTIONS)
@given(st.sampled_from(sorted(WHOLE)), st.integers(0, 20_000))
def test_beginnings_are_recognised_or_refused(form: str, length: int) -> None:
    """A file cut anywhere is of its own kind or of none; never of another format."""
    _, kind, whole = WHOLE[form]
    found = kind_of_bytes(whole[:length], len(whole[:length]))
    assert found.format in (kind, None)
