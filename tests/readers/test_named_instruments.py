"""Instruments that headers name, and the sensors whose columns a table has."""

from pathlib import Path

import pytest

from pipeline.errors import RawDataError
from pipeline.readers.file_kind import LAS, R2SONIC_PACKETS, XTF, FileKind
from pipeline.readers.named_instruments import named_instrument
from pipeline.readers.table_files import sensors_of_table


def _packet(model: bytes) -> bytes:
    section = b"H0" + (120).to_bytes(2, "big") + model.ljust(12, b"\0") + bytes(104)
    return b"BTH0" + (12 + len(section)).to_bytes(4, "big") + bytes(4) + section


def _las(system: bytes) -> bytes:
    return b"LASF" + bytes(22) + system.ljust(32, b"\0") + bytes(300)


@pytest.mark.parametrize(
    ("kind", "content", "name"),
    [
        (R2SONIC_PACKETS, _packet(b"2024"), "R2Sonic 2024"),
        (R2SONIC_PACKETS, _packet(b""), ""),
        (R2SONIC_PACKETS, _packet(b"\x1b[2J"), ""),
        (R2SONIC_PACKETS, _packet(b"2024")[:60], ""),
        (XTF, b"\x7b" + bytes(1023), ""),
        (LAS, _las(b"RIEGL VZ-1000"), "RIEGL VZ-1000"),
        (LAS, _las(b"MERGE"), ""),
        (LAS, b"LASF", ""),
    ],
)
def test_names_in_headers(kind: FileKind, content: bytes, name: str, tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(content)
    assert named_instrument(path, "a", kind) == name
    assert named_instrument(tmp_path / "missing", "missing", kind) == ""


def test_sensors_by_columns(tmp_path: Path) -> None:
    ins = "latitude_deg\tlongitude_deg\theight_m\troll_deg\tpitch_deg\theading_deg"
    heads = {
        "gps_ns,x_m,y_m,z_m": ["laser"],
        "# made by hand\ngps_week;seconds_of_week;ping;beam;angle_deg;sound_speed_m_s;range_m": ["mbes"],
        f"gps_ns\t{ins}\tx_m\ty_m\tz_m": ["ins", "laser"],
    }
    path = tmp_path / "a.csv"
    for head, sensors in heads.items():
        path.write_text(f"{head}\n1,2\n")
        assert sensors_of_table(path, "a.csv") == sensors
    path.write_text("gps_ns,x_m,y_m\n1,2,3\n")
    with pytest.raises(RawDataError, match=r"a\.csv: has no column z_m"):
        sensors_of_table(path, "a.csv")
    path.write_bytes(b"PAR1 and no more")
    with pytest.raises(RawDataError, match="cannot be read as a table"):
        sensors_of_table(path, "a.csv")
