"""Exported text: separators, decimal commas, headers, named columns, depths, bad rows, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import RawDataError
from pipeline.readers.exported import text_layout, text_points

ROWS = np.array([[599012.345, 3988390.001, -2.5], [599013.5, 3988391.25, 3.125], [599014.0, 3988392.5, -4.75]])
GEO = np.array([[120.123456789, 36.0, -2.5], [120.2, 36.000000123, 3.125]])


def read(path: Path, text: str, encoding: str = "utf-8") -> tuple[np.ndarray, int]:
    path.write_text(text, encoding=encoding)
    batches = list(text_points(path, text_layout(path)))
    return np.concatenate([points for points, _ in batches]), sum(lost for _, lost in batches)


def lines(rows: np.ndarray, separator: str, comma: bool = False) -> str:
    text = "\n".join(separator.join(f"{value:.9f}" for value in row) for row in rows) + "\n"
    return text.replace(".", ",") if comma else text


@pytest.mark.parametrize("separator", [" ", "   ", "\t", ",", ", ", ";"])
@pytest.mark.parametrize("header", ["", "# x y z in EPSG:32651\n", "北坐标的导出\n\n"])
def test_separators_and_headers(tmp_path: Path, separator: str, header: str) -> None:
    points, lost = read(tmp_path / "水池.xyz", header + lines(ROWS, separator))
    assert points == pytest.approx(ROWS, abs=1e-9)
    assert lost == 0


@pytest.mark.parametrize("separator", [" ", "\t", ";", "; "])
def test_decimal_comma(tmp_path: Path, separator: str) -> None:
    assert read(tmp_path / "a.txt", lines(ROWS, separator, comma=True))[0] == pytest.approx(ROWS, abs=1e-9)


def test_whole_numbers_between_commas_are_three_columns(tmp_path: Path) -> None:
    assert read(tmp_path / "a.csv", "1,2,3\n4,5,6\n")[0].tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize(
    ("head", "order", "geographic", "sign"),
    [
        ("Easting (m),Northing (m),Height (m)", [0, 1, 2], False, 1),
        ("N,E,Depth", [1, 0, 2], False, -1),
        ("# lat,lon,z", [1, 0, 2], True, 1),
        ("Longitude[deg],Latitude[deg],ELEVATION", [0, 1, 2], True, 1),
        ("\ufeff东坐标,北坐标,水深", [0, 1, 2], False, -1),
    ],
)
def test_named_columns(tmp_path: Path, head: str, order: list[int], geographic: bool, sign: int) -> None:
    path = tmp_path / "a.csv"
    rows = GEO if geographic else ROWS
    points, _ = read(path, f"{head}\n{lines(rows[:, np.argsort(order)], ',')}")
    assert points == pytest.approx(rows * [1, 1, sign], abs=1e-9)
    assert text_layout(path).geographic is geographic
    assert text_layout(path).depths == (sign < 0)


def test_columns_between_others_and_words_in_rows(tmp_path: Path) -> None:
    text = "id,quality,x,y,z\n1,good,10.5,20.5,30.5\n2,bad,,20,30\n3,good,11,nan,31\n4,good,12,22,32\n5,cut,13\n"
    points, lost = read(tmp_path / "a.csv", text)
    assert points.tolist() == [[10.5, 20.5, 30.5], [12, 22, 32]]
    assert lost == 3


def test_many_rows_come_in_batches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipeline.readers.exported.ROWS", 100)
    path = tmp_path / "a.xyz"
    rows = np.arange(3 * 1000.0).reshape(-1, 3)
    path.write_text(lines(rows, " "))
    sizes = [len(points) for points, _ in text_points(path, text_layout(path))]
    assert sizes == [100] * 10


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty"),
        (b"\xff\xfe1\0 \x002\0", "no text of 8 bits"),
        (b"hello\nworld\n", "has no row of three numbers"),
        (b"1 2\n3 4\n", "has no row of three numbers"),
        (b"x,y,quality\n1,2,3\n", "name no x, y, z"),
    ],
)
def test_refused_in_one_line(tmp_path: Path, content: bytes, said: str) -> None:
    path = tmp_path / "a.xyz"
    path.write_bytes(content)
    with pytest.raises(RawDataError, match=said) as refused:
        text_layout(path)
    assert "\n" not in str(refused.value)
