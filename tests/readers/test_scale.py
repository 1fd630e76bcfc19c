"""Big files: memory that does not grow with them, time in proportion to them; several files at a time."""

import threading
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import PoolcalError
from tests.support.files import build, ie_files, sonar_files
from tests.support.files.build import read, rows

MEGABYTE = 1 << 20


def sparse(path: Path, start: bytes, size: int, end: bytes = b"") -> None:
    """A file of zeros between ``start`` and ``end``, most of which occupies no disk."""
    with path.open("wb") as file:
        file.write(start)
        file.truncate(size)
        file.seek(0, 2)
        file.write(end)


@pytest.mark.parametrize("shell", ["bare", "xtf", "gsf", "kmall", "all"])
def test_a_gap_of_zeros_costs_no_memory(shell: str, tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    ends = build.ping(1), build.ping(2)
    if shell == "xtf":
        ends = build.xtf(ends[0]), build.xtf(ends[1])[1024:]
    if shell in SONARS:
        ends = SONARS[shell], SECOND[shell]
    kind = shell if shell in SONARS else "r2sonic"
    path.write_bytes(ends[0])
    read("mbes", path, kind)  # not the imports
    sparse(path, ends[0], 64 * MEGABYTE, ends[1])
    tracemalloc.start()
    columns, dropped = read("mbes", path, kind)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    first = {"gsf": 0, "kmall": 500, "all": 500}.get(shell, 1)
    assert np.unique(columns["ping"]).tolist() == [first, first + 1]
    assert rows(columns) == 10
    assert sum(dropped.values()) >= 1
    assert peak < 16 * MEGABYTE


@pytest.mark.parametrize("size", [64 * MEGABYTE, 193 * MEGABYTE + 7])
def test_a_line_without_end_costs_no_memory(size: int, tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    start = ie_files.whole("degrees", ie_files.truth(100))
    sparse(path, start, size, b"\n" + start.splitlines(keepends=True)[-1].replace(b"604799.900", b"604799.950"))
    tracemalloc.start()
    columns, dropped = read("ins", path, "inertial_explorer")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert rows(columns) == 101
    assert sum(dropped.values()) >= 1
    assert peak < 96 * MEGABYTE


SONARS = {"gsf": sonar_files.gsf(1), "kmall": sonar_files.kmall(1), "all": sonar_files.kongsberg_all(1)}
TWO = {"gsf": sonar_files.gsf(2), "kmall": sonar_files.kmall(2), "all": sonar_files.kongsberg_all(2)}
SECOND = {shell: content[len(SONARS[shell]) :] for shell, content in TWO.items()}  # the second ping alone
LIES = {  # what keeps a reader searching: starts of records that are none
    "names": (b"BTH0", "bare"),
    "packets that are too long": (b"BTH0\0\0\xff\xff", "bare"),
    "packets of nothing": (b"BTH0\0\0\0\x0c\0\0\0\0", "bare"),
    "marks": (b"\xce\xfa", "xtf"),
    "hashes before letters": (b"#MRZ", "kmall"),
    "datagrams of the least length": (b"\x18\0\0\0#MRZ" + bytes(12) + b"\x18\0\0\0", "kmall"),
    "datagrams of another length at their end": (b"\xff\0\0\0#MRZ", "kmall"),
    "begins of datagrams": (b"\2N", "all"),
    "long datagrams": (b"\0\0\x0f\0" + sonar_files.kongsberg_all(1)[4:20], "all"),
    "pings of nothing": (b"\0\0\0\4\0\0\0\2\0\0\0\0", "gsf"),
    "kinds of records": (b"\0\0\0\2", "gsf"),
    "long records": (b"\0\7\xff\xff\0\0\0\2", "gsf"),
    "records of the least length": (b"\xce\xfa\x41\0\0\0\0\0\0\0\x0e\0\0\0", "xtf"),
    "long headers": (b"\xaaD\x12\x1c", "binary"),
    "short headers": (b"\xaaD\x13\xff\xfc\x01", "binary"),
    "hashes": (b"#A", "ascii"),
    "lines": (b"#INSPVAA,\n", "ascii"),
}
START = {
    **SONARS,
    "bare": build.ping(1), "xtf": build.xtf(build.ping(1)), "binary": build.inspvas(9.0), "ascii": build.inspvasa(9.0),
}  # fmt: skip


@pytest.mark.parametrize("what", LIES)
def test_time_grows_with_the_file_and_not_faster(what: str, tmp_path: Path) -> None:
    lie, shell = LIES[what]
    sensor, kind = ("mbes", "r2sonic") if shell in ("bare", "xtf") else ("ins", "novatel")
    if shell in SONARS:
        sensor, kind = "mbes", shell
    path = tmp_path / "a.bin"

    def seconds(size: int) -> float:
        path.write_bytes(START[shell] + lie * (size // len(lie)))
        start = time.process_time()
        try:
            columns, _ = read(sensor, path, kind)
            assert rows(columns) >= 1
        except PoolcalError:
            pass
        return time.process_time() - start

    size = 40_000 if sensor == "mbes" else 4_000
    seconds(size)  # not the imports
    small = seconds(size)
    decoder = 2e-4 * (8 * size // len(lie)) if sensor == "ins" else 0.0  # NovAtel's, for each false start after 16 kB
    assert seconds(8 * size) < 24 * small + 0.3 + decoder


def test_las_header_that_claims_four_billion_points(tmp_path: Path) -> None:
    path = tmp_path / "a.las"
    path.write_bytes(build.las([(1, 2, 3, 4e8 + 0.001)] * 10, claimed=4_000_000_000))
    tracemalloc.start()
    columns, dropped = read("laser", path, "las")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert rows(columns) == 10
    assert dropped == {"truncated": 3_999_999_990}
    assert peak < 32 * MEGABYTE


def test_chunks_are_of_bounded_size(tmp_path: Path) -> None:
    """However long the file is: 200,000 records come in several chunks."""
    path = tmp_path / "a.out"
    table = np.tile(np.array(build.sbet_row(0.0)), (200_000, 1))
    table[:, 0] = 1000 + np.arange(200_000) / 200
    path.write_bytes(table.tobytes())
    from pipeline.readers.dispatch import raw_parts

    (part,) = raw_parts("ins", build.settings("ins", ["a.out"], "sbet", gps_week=build.WEEK), tmp_path)
    lengths = [len(chunk.columns["t_ns"]) for chunk in part.chunks()]
    assert sum(lengths) == 200_000
    assert max(lengths) <= 100_000


def _contents() -> dict[str, tuple[str, str, bytes]]:
    return {
        "a.gps": ("ins", "novatel", b"".join(build.inspvas(10.0 + k / 100) for k in range(1500))),
        "b.asc": ("ins", "novatel", b"".join(build.inspvasa(10.0 + k / 100) for k in range(1500))),
        "c.out": ("ins", "sbet", build.sbet(*(10.0 + k / 100 for k in range(1500)))),
        "d.las": ("laser", "las", build.las([(k, 0, 0, 4e8 + k / 1000 + 0.0001) for k in range(1500)])),
        "e.xtf": ("mbes", "r2sonic", build.xtf(*(build.ping(k) for k in range(300)))),
        "g.txt": ("ins", "inertial_explorer", ie_files.whole("utc", ie_files.truth(1500))),
        "f.csv": ("laser", "table", b"gps_ns,x_m,y_m,z_m\n" + b"1400000000000000000,1,2,3\n" * 1500),
    }


def test_files_read_side_by_side_in_threads(tmp_path: Path) -> None:
    contents = _contents()
    for name, (_, _, content) in contents.items():
        (tmp_path / name).write_bytes(content)

    def reading(name: str) -> Callable[[], dict[str, np.ndarray]]:
        sensor, kind, _ = contents[name]
        more = {"gps_week": build.WEEK} if sensor != "mbes" else {}
        return lambda: read(sensor, tmp_path / name, kind, **more)[0]

    alone = {name: reading(name)() for name in contents}
    together: list[tuple[str, dict[str, np.ndarray]]] = []
    jobs = [threading.Thread(target=lambda n=name: together.append((n, reading(n)()))) for name in [*contents] * 3]
    for job in jobs:
        job.start()
    for job in jobs:
        job.join()
    assert len(together) == 3 * len(contents)
    for name, columns in together:
        for column, values in columns.items():
            assert np.array_equal(values, alone[name][column]), (name, column)
