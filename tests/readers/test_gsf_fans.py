"""GSF: fans that are read, and those that are refused: single beams, several or stabilised fans, tilted sectors."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.errors import RawDataError
from tests.support.files.build import read, rows
from tests.support.files.sonar_files import (
    SCALES,
    gsf_header,
    gsf_ping,
    gsf_placed,
    seabat,
)

SOUND = SCALES + seabat(1480.0)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "a.gsf"


def kongsberg(**fields: int) -> bytes:
    """Kongsberg's part of a ping, made by the library: it has the sonar's modes."""
    from GSFU.gsfu import _encode_kmall_specific, new_kmall_specific

    part = new_kmall_specific() | {"SoundSpeedAtTxDepth_mPerSec": 1450.0} | fields
    return bytes(_encode_kmall_specific(part))


@pytest.mark.parametrize("field", ["RxTransducerInd", "SwathAlongPosition"])
def test_several_fans(field: str, file: Path) -> None:
    pings = gsf_ping(0, extra=SCALES + kongsberg()), gsf_ping(1, extra=kongsberg(**{field: 1}))
    file.write_bytes(gsf_header() + b"".join(pings))
    with pytest.raises(RawDataError, match=r"a\.gsf: .*several receivers or swaths.*log one head alone"):
        read("mbes", file, "gsf")


@pytest.mark.parametrize("mode", [0, 1, 2, 8])
def test_a_stabilised_fan(mode: int, file: Path) -> None:
    file.write_bytes(gsf_header() + gsf_ping(extra=SCALES + kongsberg(ModeAndStabilisation=mode)))
    if mode in (0, 8):
        assert np.all(read("mbes", file, "gsf")[0]["sound_speed_m_s"] == 1450.0)
    else:
        with pytest.raises(RawDataError, match=r"a\.gsf: .*stabilisation.*switch both off"):
            read("mbes", file, "gsf")


def test_tilted_sectors(file: Path) -> None:
    """GSF has their tilts, and nothing of how the transmitter is mounted."""
    tilted = kongsberg_sectors(0.0, 0.0), kongsberg_sectors(0.0, -0.75)
    file.write_bytes(gsf_header() + gsf_ping(extra=SCALES + tilted[0]))
    assert rows(read("mbes", file, "gsf")[0]) == 5
    file.write_bytes(gsf_header() + gsf_ping(extra=SCALES + tilted[1]))
    with pytest.raises(RawDataError, match=r"a\.gsf: .*tilted by -0\.75 degrees.*\.kmall or \.all") as error:
        read("mbes", file, "gsf")
    assert "\n" not in str(error.value)


def kongsberg_sectors(*tilts_deg: float) -> bytes:
    """Kongsberg's part of a ping with its sectors, made by the library."""
    from GSFU.gsfu import _encode_kmall_specific, new_kmall_specific, new_kmall_tx_sector

    rows = [new_kmall_tx_sector() | {"TiltAngleReTx_deg": tilt} for tilt in tilts_deg]
    sectors = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    part = new_kmall_specific() | {"SoundSpeedAtTxDepth_mPerSec": 1450.0, "TxSectors": sectors}
    return bytes(_encode_kmall_specific(part))


def test_a_single_beam(file: Path) -> None:
    file.write_bytes(gsf_header() + gsf_ping(0, (9000,), (0,), SOUND, beams=1))
    with pytest.raises(RawDataError, match=r"a\.gsf: .*one beam.*multibeam"):
        read("mbes", file, "gsf")


# --- fans by where the file says that soundings lie ------------------------------------------------------------------
YAW, LEAN = np.tan(np.radians([-2.0, 1.2]))  # of a fan in the body: forward = 0.2 m + YAW starboard + LEAN down


def fans(pitches_deg: np.ndarray, fixed: bool = True, turn_deg: float = 0.0, sector_deg: float = 0.0) -> bytes:
    """Pings whose soundings lie on a wall and a floor, in a fan fixed to the pitching and rolling boat, or to the level
    frame; with a turn that swings, or with outer sectors tilted."""
    pings = []
    for k, pitch in enumerate(pitches_deg):
        roll = 2 * np.sin(k)
        R = Rotation.from_euler("ZYX", [0, pitch if fixed else 0, roll], degrees=True).as_matrix()
        down = np.linspace(2.0, 5.0, 20)
        starboard = np.concatenate([np.full(10, 5.0), np.linspace(4.5, -1.0, 10)])
        down[10:] = 5.0
        turn = YAW + np.tan(np.radians(turn_deg * np.sin(2.1 * k)))
        forward = 0.2 + turn * starboard + LEAN * down
        forward[:5] += np.tan(np.radians(sector_deg)) * np.hypot(starboard, down)[:5]
        pings.append(gsf_placed(k, np.column_stack([forward, starboard, down]) @ R.T, (pitch, roll)))
    return gsf_header() + b"".join(pings)


PITCHES = 0.4 * np.sin(1.3 * np.arange(40))  # 0.28 degrees RMS


def test_fans_fixed_to_the_boat_are_read(file: Path) -> None:
    file.write_bytes(fans(PITCHES))
    assert rows(read("mbes", file, "gsf")[0]) == 800


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"fixed": False}, r"stand level while the boat pitches, to 0\.0\d degrees \(in the boat to 0\.[23]\d"),
        ({"turn_deg": 1.0}, r"not fixed to the boat: .*leave one plane by 0\.[3-9]\d degrees"),
        ({"sector_deg": 1.0}, r"not fixed to the boat"),
    ],
)
def test_fans_that_turn_against_the_boat(more: dict[str, Any], words: str, file: Path) -> None:
    file.write_bytes(fans(PITCHES, **more))
    with pytest.raises(RawDataError, match=rf"a\.gsf: its fans .*{words}.*\.kmall and \.all") as error:
        read("mbes", file, "gsf")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("pitches", [PITCHES / 5, PITCHES[:2]])
def test_where_nothing_can_be_told_of_fans(pitches: np.ndarray, file: Path) -> None:
    """Stabilised fans of a boat that pitches by less than a twentieth of a degree are as good as fixed; of two pings
    nothing is said."""
    file.write_bytes(fans(pitches, fixed=False))
    assert rows(read("mbes", file, "gsf")[0]) == 20 * len(pitches)


def test_distances_along_track_that_are_all_zero_tell_nothing(file: Path) -> None:
    places = [(0.0, across, 5.0) for across in np.linspace(-4, 4, 20)]
    pings = [gsf_placed(k, places, (pitch, 0.0)) for k, pitch in enumerate(10 * PITCHES)]
    file.write_bytes(gsf_header() + b"".join(pings))
    assert rows(read("mbes", file, "gsf")[0]) == 800
