"""Kongsberg .kmall: the soundings of #MRZ datagrams ("KMALL datagram description", 410224; little-endian).

The library pykmall decodes the parts of a datagram before its soundings. It cannot read a whole file: its functions
print, hold the index of the whole file, raise various errors at the first damaged datagram, and may never return. It
also makes a dictionary of each sounding, and ignores the size of a sounding that the datagram states. Therefore
:mod:`pipeline.readers.kmall_datagrams` finds the datagrams, and numpy reads all soundings of a datagram at once.

Offsets in bytes within a sounding: 2 u8 transmit sector, 3 u8 type (0 normal, 1 extra, 2 rejected), 72 f32 angle to the
array [degrees], 80 f32 two-way travel time [s]. Angle and time contain the corrections at 76 and 84 already. The time
of a sounding is the datagram's time (that of the first sector) plus the delay of the sounding's sector. In the file
angles and the edges of sectors are positive to port. The reader turns the angles to starboard +. The sound speed is the
one at the transducer's depth.

The frame ``mbes`` is that of the receiving array, because the beam angles refer to this array. The receiver's
installation angles (#IIP, TRAI_RX) are not applied, because the estimated mount replaces them. If the array is mounted
the other way round, the yaw of the mount is near 180 degrees. Each sector has its own tilt along track (txSectorInfo,
tiltAngleReTx: the steering of the main lobe as sent, in the transmitter's own frame), and is sent from its own part of
the transmitter. Both are transformed to the frame ``mbes`` with the installation
(:mod:`pipeline.readers.kongsberg_arrays`). The tilt includes all steering: stabilisation of pitch or yaw, the swath of
a dual swath, the mode of a ping. A file of two receivers, or of single-beam pings, is refused.
"""

import io
import struct
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np

from pipeline.gps_time import NS, gps_ns_from_unix_utc
from pipeline.readers.kmall_datagrams import IIP, KMALL_HEAD, KMALL_LENGTH, kmall_datagrams
from pipeline.readers.kongsberg import KongsbergPart, KongsbergPing, PingSectors, are_possible
from pipeline.readers.kongsberg_arrays import Transmitter
from pipeline.readers.kongsberg_installation import SINGLE_HEAD, transmitters_of_kmall
from pipeline.readers.repeated_pings import RepeatedPings
from pipeline.readers.sounding_chunks import MAX_BEAMS

MIN_MRZ_BYTES = 200  # the parts before the soundings alone are longer
MIN_SOUNDING_BYTES = 88  # least size of a sounding that holds the fields to read
NORMAL, EXTRA, REJECTED = 0, 1, 2
Installation = Mapping[tuple[int, int], Transmitter]  # by the numbers of transmitter and receiver


@dataclass(frozen=True)
class KmallPart(KongsbergPart):
    """One .kmall file."""

    def _pings(self, file: BinaryIO, dropped: Counter[str]) -> Iterator[KongsbergPing]:
        installation: Installation = {}
        repeated = RepeatedPings()
        for datagram in kmall_datagrams(file, dropped):
            if datagram[4:8] == IIP:
                installation = transmitters_of_kmall(datagram.decode("latin-1"))
            elif (ping := decode_mrz(datagram, installation)) is not None:
                if repeated.is_new(datagram, dropped):
                    yield ping
            else:
                dropped["damaged datagram"] += 1


@np.errstate(all="ignore")  # damaged numbers are counted, without numpy's warnings
def decode_mrz(datagram: bytes, installation: Installation) -> KongsbergPing | None:
    """Return the ping of one #MRZ datagram; None if it is damaged, or one of several datagrams of the same ping."""
    from KMALL import kmall

    if len(datagram) < MIN_MRZ_BYTES:
        return None
    reader: Any = kmall()
    reader.FID = io.BytesIO(datagram)
    try:
        _, _, _, _, _, seconds, nanoseconds = KMALL_HEAD.unpack_from(datagram)
        reader.read_EMdgmHeader()
        partition = reader.read_EMdgmMpartition()
        common = reader.read_EMdgmMbody()
        info = reader.read_EMdgmMRZ_pingInfo()
        sector_infos = _sector_infos(reader, info)
        receiver = reader.read_EMdgmMRZ_rxInfo()
    except (struct.error, ValueError, OverflowError, OSError):
        return None
    step = receiver["numBytesPerSounding"]
    count = receiver["numSoundingsMaxMain"] + receiver["numExtraDetections"]
    start = reader.FID.tell() + receiver["numExtraDetectionClasses"] * receiver["numBytesPerClass"]
    if partition["numOfDgms"] != 1 or nanoseconds >= NS or step < MIN_SOUNDING_BYTES or count > MAX_BEAMS:
        return None
    if start + count * step > len(datagram) - KMALL_LENGTH.size:
        return None
    soundings = np.frombuffer(datagram, _sounding_layout(step), count, start)
    sectors = _transmit_sectors(sector_infos, common["rxTransducerInd"], installation)
    if not are_possible(sectors, soundings["sector"]):
        return None
    return KongsbergPing(
        t_ns=int(gps_ns_from_unix_utc(np.array([seconds]), np.array([nanoseconds]))[0]),
        number=common["pingCnt"],
        receiver=str(common["rxTransducerInd"]),
        sound_speed_m_s=info["soundSpeedAtTxDepth_mPerSec"],
        sectors=sectors,
        sector=soundings["sector"],
        extra=soundings["type"] == EXTRA,
        rejected=soundings["type"] >= REJECTED,
        angle_deg=soundings["angle"].astype(np.float64),
        two_way_time_s=soundings["time"].astype(np.float64),
    )


def _sounding_layout(step: int) -> np.dtype[Any]:
    """Return the numpy type of a sounding of ``step`` bytes."""
    return np.dtype(
        {
            "names": ["sector", "type", "angle", "time"],
            "formats": ["u1", "u1", "<f4", "<f4"],
            "offsets": [2, 3, 72, 80],
            "itemsize": step,
        }
    )


def _sector_infos(reader: Any, info: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the txSectorInfo of all sectors, and set the reader's position to the byte after the last one."""
    sector_infos = []
    start = reader.FID.tell()
    for number in range(min(info["numTxSectors"], 256)):
        reader.FID.seek(start + number * info["numBytesPerTxSector"])
        sector_infos.append(reader.read_EMdgmMRZ_txSectorInfo())
    reader.FID.seek(start + info["numTxSectors"] * info["numBytesPerTxSector"])
    return sector_infos


def _transmit_sectors(sector_infos: list[dict[str, Any]], receiver: int, installation: Installation) -> PingSectors:
    """Return the sectors, each with its transmitter; in a head with both arrays the receiver's number selects it."""
    names = ("sectorTransmitDelay_sec", "tiltAngleReTx_deg", "txSubArray")
    delay_s, tilt_deg, array_part = (np.array([sector[name] for sector in sector_infos]) for name in names)
    head = installation.get((SINGLE_HEAD, receiver))
    transmitters = [installation.get((sector["txArrNumber"], receiver), head) for sector in sector_infos]
    return PingSectors(delay_s, tilt_deg, array_part, transmitters)
