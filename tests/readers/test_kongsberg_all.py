"""Kongsberg .all: signs, times of sectors, tilts, what is left out and what is refused; files made byte by byte."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.config.session import Mbes
from pipeline.errors import RawDataError
from pipeline.gps_time import GPS_EPOCH_UNIX_S
from pipeline.readers import sounding_chunks
from pipeline.readers.dispatch import raw_parts
from tests.support.files.build import MOUNT, read, rows
from tests.support.files.sonar_files import (
    RECEIVER,
    TRANSMITTER,
    all_datagram,
    all_installation,
    kongsberg_all,
    raw_ranges,
)

NS = 10**9
TEN = 1_715_508_000 - GPS_EPOCH_UNIX_S + 18  # 2024-05-12 10:00:00 UTC, eighteen leap seconds since 1980
FAN = [(60.0, 0, 0.009), (30.0, 0, 0.008), (0.0, 0, 0.007), (-30.0, 0, 0.008), (-60.0, 0, 0.009)]
THREE = [(50.0, 0, 0.009), (0.0, 1, 0.008), (-50.0, 2, 0.009)]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.all"


def test_values_signs_and_times(file: Path) -> None:
    """Kongsberg's port + becomes starboard +; UTC becomes GPS; a sector has a time of its own."""
    beams = [(angle, k // 2, time) for k, (angle, _, time) in enumerate(FAN)]
    content = raw_ranges(7, beams, (0.0,) * 3, (0.0, 2e-4, 4e-4), (1, 1, 1), milliseconds=36_000_250)
    file.write_bytes(content + raw_ranges(8, FAN, speed_m_s=1471.3))
    columns, dropped = read("mbes", file, "all", latency_s=0.25)
    assert not dropped
    sent = TEN * NS + np.array([0, 0, 200_000, 200_000, 400_000] + [-250_000_000] * 5)
    assert columns["t_ns"].tolist() == sent.tolist()
    assert columns["ping"].tolist() == [7] * 5 + [8] * 5
    assert columns["beam"].tolist() == [0, 1, 2, 3, 4] * 2
    assert np.degrees(columns["angle_rad"][:5]) == pytest.approx([-60.0, -30.0, 0.0, 30.0, 60.0])
    assert columns["two_way_time_s"][:5] == pytest.approx([0.009, 0.008, 0.007, 0.008, 0.009], rel=1e-7)
    assert columns["sound_speed_m_s"] == pytest.approx([1480.0] * 5 + [1471.3] * 5)
    assert not columns["transmit_tilt_rad"].any()


@pytest.mark.parametrize(("turned", "sign"), [("", 1), ("S1", -1), ("S2", -1)])
def test_tilts_in_the_receiver_s_frame(turned: str, sign: int, file: Path) -> None:
    """Forward + is the transmitter's own, which may look aft, as may the receiver. Beams name a sector by the order of
    sectors, not by the number of the transmitter's part."""
    text = f"STC=0,{TRANSMITTER},{RECEIVER}".replace(f"{turned}H=0", f"{turned}H=180")
    ping = raw_ranges(1, THREE, (0.5, 1.25, -10), (), (2, 1, 0), model=710)
    file.write_bytes(all_installation(text, model=710) + ping)
    columns, _ = read("mbes", file, "all")
    assert np.degrees(columns["transmit_tilt_rad"]) == pytest.approx([sign * 0.5, sign * 1.25, sign * -10.0])


@pytest.mark.parametrize("spoilt", ["S1H=", "S1H=1.8e2", "S2P=x", "S2H=180 0"])
def test_an_angle_that_cannot_be_read_is_not_nothing(spoilt: str, file: Path) -> None:
    text = f"STC=0,{TRANSMITTER},{RECEIVER}".replace(f"{spoilt[:4]}0.00", spoilt)
    file.write_bytes(all_installation(text, model=710) + raw_ranges(1, THREE, (0.5, 1.25, -10), (), (), model=710))
    with pytest.raises(RawDataError, match=r"a\.all: .*tilted.*does not tell"):
        read("mbes", file, "all")


@pytest.mark.parametrize(("model", "turned"), [(3020, 1), (710, -1)])
def test_the_second_transducer_of_heads_without_configuration(model: int, turned: int, file: Path) -> None:
    """S2 is another head of an EM 3002, which may not be there; of an EM 710 the receiver."""
    text = f"{TRANSMITTER},{RECEIVER}".replace("S1X=0.00", "S1X=1.50").replace("S1H=0", "S1H=180")
    file.write_bytes(all_installation(text, model=model) + raw_ranges(1, FAN, (0.5,), model=model))
    columns, _ = read("mbes", file, "all")
    assert np.sign(columns["transmit_tilt_rad"]).tolist() == [turned] * len(columns["ping"])
    same = bool(np.allclose(columns["two_way_time_s"], [time for *_, time in FAN], rtol=1e-6))
    assert same == (model == 3020)


def test_a_ping_that_is_there_twice_counts_once(file: Path) -> None:
    content = b"".join(raw_ranges(number, FAN) for number in (1, 2))
    file.write_bytes(content + content)
    columns, dropped = read("mbes", file, "all")
    assert columns["ping"].tolist() == [1] * 5 + [2] * 5
    assert dropped == {"repeated ping": 2}


def test_a_first_datagram_of_123_bytes_is_no_xtf(file: Path) -> None:
    """XTF begins with the byte 123."""
    content = raw_ranges(1, [(float(n), 0, 0.008) for n in range(3)])
    content = all_datagram("A", 1, bytes(123 - 16 - 3)) + content
    assert content[0] == 0x7B
    file.write_bytes(content)
    assert len(read("mbes", file, "all")[0]["ping"]) == 3


def test_each_ping_has_its_own_tilts(file: Path) -> None:
    """As with stabilisation, and with two swaths a ping."""
    content = b"".join(raw_ranges(number, FAN, (tilt,), model=710) for number, tilt in ((1, 0.3), (2, -2.0), (3, 5.25)))
    file.write_bytes(all_installation(model=710) + content)
    columns, _ = read("mbes", file, "all")
    assert np.degrees(columns["transmit_tilt_rad"][::5]) == pytest.approx([0.3, -2.0, 5.25])


def test_sectors_of_an_em_2040_send_from_their_own_parts(file: Path) -> None:
    """Parts 0 and 2 lie 5.54 cm to port and starboard: outwards the way is shorter by that times sin 50 degrees."""
    file.write_bytes(all_installation() + raw_ranges(1, THREE, (0.0,) * 3, (), (0, 1, 2)))
    columns, _ = read("mbes", file, "all")
    longer = (columns["two_way_time_s"] - [0.009, 0.008, 0.009]) * 1480
    outwards = 0.0554 * np.sin(np.radians(50))
    assert longer[[0, 2]] == pytest.approx([outwards, outwards], abs=0.011)  # and 6 mm up or down
    assert abs(longer[1]) < 0.007
    file.write_bytes(all_installation(model=710) + raw_ranges(1, THREE, (0.0,) * 3, (), (0, 1, 2), model=710))
    columns, _ = read("mbes", file, "all")
    assert columns["two_way_time_s"] == pytest.approx([0.009, 0.008, 0.009], rel=1e-7)


def test_the_installation_of_the_receiver_s_serial_number(file: Path) -> None:
    """With one transmitter and two receivers, S3 is the second receiver. It looks aft."""
    third = RECEIVER.replace("S2", "S3").replace("S3H=0", "S3H=180")
    file.write_bytes(
        all_installation(f"STC=3,{TRANSMITTER},{RECEIVER},{third},R1S=77,R2S=78", model=710)
        + raw_ranges(1, FAN, (1.0,), model=710, serial=78)
    )
    assert np.degrees(read("mbes", file, "all")[0]["transmit_tilt_rad"]) == pytest.approx([-1.0] * 5)


@pytest.mark.parametrize("text", ["", "STC=4", f"STC=3,{TRANSMITTER},{RECEIVER}"])
def test_tilts_of_unknown_direction_are_refused(text: str, file: Path) -> None:
    """No installation, one of two transmitters, one that names no receiver's serial number."""
    before = all_installation(text) if text else b""
    file.write_bytes(before + raw_ranges(1, FAN, (0.3,)))
    with pytest.raises(RawDataError, match=r"a\.all: .*tilted \(0\.30 degrees\).*does not tell") as error:
        read("mbes", file, "all")
    assert "\n" not in str(error.value)
    file.write_bytes(before + raw_ranges(1, FAN))
    assert rows(read("mbes", file, "all")[0]) == 5


def test_one_head_of_both_arrays(file: Path) -> None:
    """Its tilts are those of its own frame, whatever its installation angles."""
    text = TRANSMITTER.replace("S1H=0", "S1H=180")
    file.write_bytes(all_installation(text, model=2045) + raw_ranges(1, FAN, (1.5,), model=2045))
    assert np.degrees(read("mbes", file, "all")[0]["transmit_tilt_rad"]) == pytest.approx([1.5] * 5)


# --- left out --------------------------------------------------------------------------------------------------------
def test_what_is_no_detection_or_flagged_out(file: Path) -> None:
    flags = [(0x80, 0), (1, 0), (0, -2), (0x91, -1), (0x11, 0)]
    file.write_bytes(raw_ranges(1, FAN, flags=flags) + raw_ranges(2, [(0.0, 0, 0.0), *FAN]))
    columns, dropped = read("mbes", file, "all")
    assert columns["beam"].tolist() == [1, 4, 1, 2, 3, 4, 5]
    assert dropped == {"rejected detection": 3, "no detection": 1}


def test_impossible_dates_and_speeds(file: Path) -> None:
    content = raw_ranges(1, FAN, date=20241332) + raw_ranges(2, FAN, date=19920512) + raw_ranges(3, FAN, speed_m_s=0.0)
    file.write_bytes(content)
    columns, dropped = read("mbes", file, "all")
    assert not rows(columns)
    assert dropped == {"damaged datagram": 1, "impossible time (clock not set)": 5, "impossible sound speed": 5}


# --- refused ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("more", [{"serial": 78}, {"model": 710}])
def test_several_receivers(more: dict[str, int], file: Path) -> None:
    file.write_bytes(raw_ranges(1, FAN) + raw_ranges(1, FAN, **more))
    with pytest.raises(RawDataError, match=r"a\.all: .*dual head.*log one head alone") as error:
        read("mbes", file, "all")
    assert "\n" not in str(error.value)


def test_a_single_beam(file: Path) -> None:
    file.write_bytes(raw_ranges(1, FAN[:1]))
    with pytest.raises(RawDataError, match=r"a\.all: .*one beam.*multibeam"):
        read("mbes", file, "all")


@pytest.mark.parametrize("kind", ["F", "f"])
def test_raw_ranges_of_older_sonars(kind: str, file: Path) -> None:
    file.write_bytes(all_datagram(kind, 1, bytes(200), model=3002) * 3)
    with pytest.raises(RawDataError, match=r"a\.all: .*older sonars.*3 datagrams.*GSF") as error:
        read("mbes", file, "all")
    assert "\n" not in str(error.value)


# --- damage ----------------------------------------------------------------------------------------------------------
def test_damaged_datagrams_are_counted_and_the_rest_is_read(file: Path) -> None:
    """By the sum of their bytes, by sectors that there are not, by numbers of beams that do not fit."""
    wrong = bytearray(raw_ranges(2, FAN))
    wrong[60] ^= 4
    beyond = raw_ranges(3, [(0.0, 3, 0.008)] * 2)
    longer = all_datagram("N", 4, raw_ranges(4, FAN)[20:70])
    file.write_bytes(raw_ranges(1, FAN) + bytes(wrong) + beyond + longer + raw_ranges(5, FAN))
    columns, dropped = read("mbes", file, "all")
    assert sorted(set(columns["ping"].tolist())) == [1, 5]
    assert dropped == {"damaged datagram": 3}


def test_lost_bytes_lose_one_ping(file: Path) -> None:
    pings = [raw_ranges(k, FAN) for k in range(5)]
    file.write_bytes(pings[0] + pings[1] + pings[2][:-30] + pings[3] + pings[4])
    columns, dropped = read("mbes", file, "all")
    assert sorted(set(columns["ping"].tolist())) == [0, 1, 3, 4]
    assert dropped == {"stray bytes": 1}


def test_cut_anywhere(file: Path) -> None:
    content = kongsberg_all(3)
    ends, at = [], 0
    while at < len(content):
        kind, at = content[at + 5], at + 4 + int.from_bytes(content[at : at + 4], "little")
        ends += [at] * (kind == ord("N"))
    assert len(ends) == 3
    for length in range(230, len(content), 41):
        file.write_bytes(content[:length])
        columns, dropped = read("mbes", file, "all")
        assert rows(columns) == 5 * sum(end <= length for end in ends)
        assert set(dropped) <= {"truncated datagram", "stray bytes"}


def test_chunks_stay_small(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sounding_chunks, "CHUNK_SOUNDINGS", 10)
    file.write_bytes(kongsberg_all(7))
    (part,) = raw_parts("mbes", Mbes(files=[file.name], format="all", mount=MOUNT), file.parent)
    assert [len(chunk.columns["beam"]) for chunk in part.chunks()] == [10, 10, 10, 5]
