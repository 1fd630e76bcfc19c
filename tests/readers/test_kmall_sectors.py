"""Kongsberg .kmall: the tilts of transmit sectors, and where the sectors send from."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from pipeline.config.session import Ins, Laser, Mbes, SessionConfig
from pipeline.errors import RawDataError
from pipeline.maths.sonar.soundings import points_in_mbes
from tests.support.files.build import MOUNT, read, rows
from tests.support.files.sonar_files import ANGLES_DEG, iip, mrz, sounding

FAN = [sounding(n, angle, 0.008) for n, angle in enumerate(ANGLES_DEG)]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.kmall"


# --- transmit sectors ------------------------------------------------------------------------------------------------
LEVEL = "X=0;Y=0;Z=0;R=0;P=0;H=0"
FANS = [sounding(n, angle, 0.008, sector=sector) for n, (angle, sector) in enumerate(((50, 0), (0, 1), (-50, 2)))]


def tilts(file: Path, transmitter: str = LEVEL, receiver: str = LEVEL, name: str = "X1") -> np.ndarray:
    fan = mrz(1, FANS, delays_s=(0.0, 0.0, 0.0), tilts_deg=(-0.5, 10.0, 0.25))
    file.write_bytes(iip(transmitter, receiver, name) + fan)
    return np.degrees(read("mbes", file, "kmall")[0]["transmit_tilt_rad"])


def test_each_sounding_has_its_sector_s_tilt(file: Path) -> None:
    """Forward +, as Kongsberg's own axes have it."""
    assert tilts(file) == pytest.approx([-0.5, 10.0, 0.25], abs=1e-6)


def test_a_transmitter_the_other_way_round(file: Path) -> None:
    """Its own forward is aft of the receiver's; turned both, nothing changes."""
    turned = LEVEL.replace("H=0", "H=180")
    assert tilts(file, transmitter=turned) == pytest.approx([0.5, -10.0, -0.25], abs=1e-6)
    assert tilts(file, receiver=turned) == pytest.approx([0.5, -10.0, -0.25], abs=1e-6)
    assert tilts(file, turned, turned) == pytest.approx([-0.5, 10.0, 0.25], abs=1e-6)


def test_a_transmitter_with_its_bow_down(file: Path) -> None:
    """Kongsberg's pitch is bow up +: at P = -2 the fan leans aft by 2 degrees; at the sides less."""
    (port, middle, starboard) = tilts(file, transmitter=LEVEL.replace("P=0", "P=-2"))
    assert middle == pytest.approx(8.0, abs=1e-6)
    assert port == pytest.approx(-0.5 - 2 * np.cos(np.radians(50)), abs=0.01)
    assert starboard == pytest.approx(0.25 - 2 * np.cos(np.radians(50)), abs=0.01)


def test_tilts_of_unknown_direction_are_refused(file: Path) -> None:
    """Without an installation, or with one of another transmitter: forward may be aft."""
    with pytest.raises(RawDataError, match=r"a\.kmall: .*tilted.*does not tell.*give the file as") as error:
        tilts(file, name="X2")
    assert "\n" not in str(error.value)
    file.write_bytes(mrz(1, FANS, delays_s=(0.0, 0.0, 0.0)))  # none is tilted
    assert not read("mbes", file, "kmall")[0]["transmit_tilt_rad"].any()


@pytest.mark.parametrize("value", ["180.0.0", "1e2", "", "halb", "180 0"])
def test_an_angle_that_cannot_be_read_is_not_nothing(value: str, file: Path) -> None:
    """H taken for 0 would turn tilts forward into tilts aft, without a word."""
    with pytest.raises(RawDataError, match=r"a\.kmall: .*tilted.*does not tell"):
        tilts(file, transmitter=LEVEL.replace("H=0", f"H={value}"))
    with pytest.raises(RawDataError, match=r"a\.kmall: .*tilted.*does not tell"):
        tilts(file, receiver=LEVEL.replace(";H=0", ""))


@pytest.mark.parametrize("value", [" 180.0 ", "180.000000000000", "+180", "180."])
def test_angles_however_written(value: str, file: Path) -> None:
    assert tilts(file, transmitter=LEVEL.replace("H=0", f"H={value}")) == pytest.approx([0.5, -10.0, -0.25], abs=1e-6)


def test_a_second_installation_goes_before_the_first(file: Path) -> None:
    """As where a file goes on after the boat was changed; one that cannot be read does not leave the first in force."""
    fan = mrz(1, FANS, delays_s=(0.0, 0.0, 0.0), tilts_deg=(-0.5, 10.0, 0.25))
    later = mrz(2, FANS, delays_s=(0.0, 0.0, 0.0), tilts_deg=(-0.5, 10.0, 0.25))
    file.write_bytes(iip(LEVEL, LEVEL) + fan + iip(LEVEL.replace("H=0", "H=180"), LEVEL) + later)
    found = np.degrees(read("mbes", file, "kmall")[0]["transmit_tilt_rad"])
    assert found == pytest.approx([-0.5, 10.0, 0.25, 0.5, -10.0, -0.25], abs=1e-6)
    file.write_bytes(iip(LEVEL, LEVEL) + fan + iip("X=a;Y=b", LEVEL) + later)
    with pytest.raises(RawDataError, match=r"a\.kmall: .*tilted.*does not tell"):
        read("mbes", file, "kmall")


def test_one_head_of_both_arrays(file: Path) -> None:
    content = iip(LEVEL, LEVEL).replace(b"TRAI_TX1", b"TRAI_HD1").replace(b"TRAI_RX1", b"OTHERRX1")
    file.write_bytes(content + mrz(1, FANS, delays_s=(0.0, 0.0, 0.0), tilts_deg=(-0.5, 10.0, 0.25)))
    columns, _ = read("mbes", file, "kmall")
    assert np.degrees(columns["transmit_tilt_rad"]) == pytest.approx([-0.5, 10.0, 0.25], abs=1e-6)


@pytest.mark.parametrize("mode", [0, 1, 2, 3, 4, 8, 0b11111100])
def test_the_tilt_holds_the_steering_of_stabilisation(mode: int, file: Path) -> None:
    """Each ping has its own; both swaths of a dual swath have one number, each its own tilts."""
    pings = [mrz(7, FAN, mode=mode, swath=swath, tilts_deg=(tilt,)) for swath, tilt in ((0, 1.0), (1, -1.5))]
    file.write_bytes(iip(LEVEL, LEVEL) + b"".join(pings) + mrz(8, FAN, mode=mode, tilts_deg=(3.0,)))
    columns, dropped = read("mbes", file, "kmall")
    assert not dropped
    assert columns["ping"].tolist() == [7] * 10 + [8] * 5
    assert np.degrees(columns["transmit_tilt_rad"]) == pytest.approx([1.0] * 5 + [-1.5] * 5 + [3.0] * 5, abs=1e-6)


@pytest.mark.parametrize("tilt", [46.0, float("nan"), float("inf")])
def test_impossible_tilts(tilt: float, file: Path) -> None:
    file.write_bytes(iip(LEVEL, LEVEL) + mrz(1, FAN, tilts_deg=(tilt,)) + mrz(2, FAN))
    columns, dropped = read("mbes", file, "kmall")
    assert rows(columns) == 5
    assert dropped == {"damaged datagram": 1}


# --- where the sectors send from -------------------------------------------------------------------------------------
APART = "X=0.30;Y=-0.10;Z=0.02;R=1;P=2;H=181;IPX=0;IPY=-0.05;IPZ=-0.01;ICX=0;ICY=0;ICZ=-0.006;ISX=0;ISY=0.05;ISZ=-0.01"
RECEIVER = "X=0.05;Y=0.01;Z=0;R=-3;P=-1;H=0.5;IX=-0.01;IY=0;IZ=-0.006"


def turned(roll_deg: float, pitch_deg: float, heading_deg: float) -> np.ndarray:
    return Rotation.from_euler("ZYX", [heading_deg, pitch_deg, roll_deg], degrees=True).as_matrix()


def test_ranges_run_from_the_sector_s_part_to_the_receiver(file: Path) -> None:
    """Targets seen by beams and fans of arrays that lie apart and are turned against each other, in Kongsberg's axes;
    what is read places them all, from one point: the receiver's, but forward the transmitter's."""
    speed, tx, rx = 1480.0, turned(1, 2, 181), turned(-3, -1, 0.5)
    parts = [np.array([0.30, -0.10, 0.02]) + tx @ [0, y, z] for y, z in ((-0.05, -0.01), (0, -0.006), (0.05, -0.01))]
    centre = np.array([0.05, 0.01, 0]) + rx @ [-0.01, 0, -0.006]
    found, seen, targets = [], [], []
    for number, (part, angle, tilt) in enumerate(((2, 65.0, 0.8), (1, 20.0, -3.0), (1, -5.0, -3.0), (0, -60.0, 8.0))):

        def contradicts(x: np.ndarray, part: int = part, angle: float = angle, tilt: float = tilt) -> list[float]:
            sent, heard = x - parts[part], x - centre
            fan = sent @ tx[:, 0] / np.linalg.norm(sent) - np.sin(np.radians(tilt))
            beam = heard @ rx[:, 1] / np.linalg.norm(heard) - np.sin(np.radians(-angle))
            return [fan, beam, np.linalg.norm(heard) - 4.0]

        below = rx @ [0, np.sin(np.radians(-angle)), np.cos(np.radians(angle))]
        target = fsolve(contradicts, centre + 4 * below, xtol=1e-13)
        assert np.abs(contradicts(target)).max() < 1e-10
        time = (np.linalg.norm(target - parts[part]) + np.linalg.norm(target - centre)) / speed
        found.append(sounding(number, angle, time, sector=number))
        seen.append((part, tilt))
        targets.append(target)
    subarrays, sector_tilts = zip(*seen, strict=True)
    fan = mrz(1, found, delays_s=[0.0] * 4, tilts_deg=sector_tilts, subarrays=subarrays, speed_m_s=speed)
    file.write_bytes(iip(APART, RECEIVER) + fan)
    forward = rx[:, 0]
    origin = centre + (np.array([0.30, -0.10, 0.02]) - centre) @ forward * forward
    wanted = (np.array(targets) - origin) @ rx @ [[0, 1, 0], [1, 0, 0], [0, 0, -1]]
    for more in ({}, {"projector_offset_m": mbes_from(rx, np.array([0.30, -0.10, 0.02]) - centre)}):
        columns, _ = read("mbes", file, "kmall", **more)
        names = ("two_way_time_s", "angle_rad", "transmit_tilt_rad", "sound_speed_m_s")
        offset = np.array(more["projector_offset_m"]) if more else None
        points, valid = points_in_mbes(*(columns[name] for name in names), projector_offset_m=offset)
        assert valid.all()
        assert points == pytest.approx(wanted, abs=2e-6)  # times and angles are single precision


def mbes_from(rx: np.ndarray, vessel: np.ndarray) -> tuple[float, float, float]:
    x, y, z = rx.T @ vessel
    return float(y), float(x), float(-z)


def test_without_an_installation_times_and_angles_stay_as_recorded(file: Path) -> None:
    file.write_bytes(mrz(1, FAN))
    columns, _ = read("mbes", file, "kmall")
    assert columns["two_way_time_s"].tolist() == [float(np.float32(0.008))] * 5
    file.write_bytes(iip(APART, RECEIVER) + mrz(1, [sounding(0, 0.0, 0.0), sounding(1, 0.0, 1e-5)]))
    _, dropped = read("mbes", file, "kmall")
    assert dropped == {"no detection": 1, "beam, fan and range do not meet": 1}  # the arrays lie farther apart


@pytest.mark.parametrize(("kind", "read_again"), [("kmall", True), ("all", True), ("r2sonic", False)])
def test_files_are_read_again_where_their_reading_takes_the_transmitter_s_place(kind: str, read_again: bool) -> None:
    """Where a format has no place of the transmitter, it is added afterwards, without reading."""
    sonar = Mbes(files=["a"], format=kind, mount=MOUNT)
    session = SessionConfig(
        name="a", ins=Ins(files=["i"], format="sbet"), laser=Laser(files=["l"], format="las", mount=MOUNT), mbes=sonar
    )
    moved = sonar.model_copy(update={"projector_offset_m": (0.0, 0.1, 0.0)})
    other = session.model_copy(update={"mbes": moved})
    assert (session.recordings != other.recordings) == read_again
