"""Kongsberg .kmall: the soundings of #MRZ datagrams ("KMALL datagram description", 410224; little-endian).

pykmall decodes a datagram's heads, each from its own bytes. It cannot lead through a file: its index and scan print,
hold all of the file's index, end with any exception at the first damaged datagram, and may not end at all. It also
makes a dictionary of each sounding, and ignores the size that the datagram gives for one. So
:mod:`pipeline.readers.kmall_datagrams` finds the datagrams, and all soundings of a datagram are read at once.

Offsets in bytes within a sounding: 2 u8 transmit sector, 3 u8 type (0 normal, 1 extra, 2 rejected), 72 f32 angle to the
array [degrees], 80 f32 two-way travel time [s]; corrections at 76 and 84 are applied in them already. Time is the
datagram's, that of the first sector, and the delay of the sounding's own sector. Angles are positive to port, as is the
sign of the sectors' edges (port +, starboard -); here starboard +. The sound speed is that at the transducer's depth.

The frame ``mbes`` is that of the receiver's array, to which the beam angles refer. The angles of the installation
(#IIP, TRAI_RX) are not applied: the estimated mount stands in their place, and the yaw of an array mounted the other
way round is near 180 degrees. Each sector is tilted along track by itself (txSectorInfo, tiltAngleReTx: the steering of
the main lobe as sent, in the transmitter's own frame), and sends from its own part of the transmitter. The installation
turns both into the frame ``mbes`` (:mod:`pipeline.readers.kongsberg_arrays`). The tilt includes all that steered the
sector: stabilisation of pitch or yaw, the swath of a dual swath, the mode of a ping. Only one of two receivers can
be calibrated; pings of a single beam are no fan.
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

MIN_MRZ_BYTES = 200  # its heads alone are longer
MIN_SOUNDING_BYTES = 88  # of a sounding, those that are needed
NORMAL, EXTRA, REJECTED = 0, 1, 2
Installation = Mapping[tuple[int, int], Transmitter]  # by transmitter and receiver


@dataclass(frozen=True)
class KmallPart(KongsbergPart):
    """One file."""

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


@np.errstate(all="ignore")  # damaged numbers are counted, not warned of
def decode_mrz(datagram: bytes, installation: Installation) -> KongsbergPing | None:
    """Return the contents of one #MRZ datagram; None where they contradict themselves, or are one part of several."""
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
    """Return the layout of a sounding of ``step`` bytes."""
    return np.dtype(
        {
            "names": ["sector", "type", "angle", "time"],
            "formats": ["u1", "u1", "<f4", "<f4"],
            "offsets": [2, 3, 72, 80],
            "itemsize": step,
        }
    )


def _sector_infos(reader: Any, info: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the datagram's txSectorInfo, and leave the reader behind them."""
    sector_infos = []
    start = reader.FID.tell()
    for number in range(min(info["numTxSectors"], 256)):
        reader.FID.seek(start + number * info["numBytesPerTxSector"])
        sector_infos.append(reader.read_EMdgmMRZ_txSectorInfo())
    reader.FID.seek(start + info["numTxSectors"] * info["numBytesPerTxSector"])
    return sector_infos


def _transmit_sectors(sector_infos: list[dict[str, Any]], receiver: int, installation: Installation) -> PingSectors:
    """Return the sectors, each with its transmitter; a head of both arrays has one number for them."""
    names = ("sectorTransmitDelay_sec", "tiltAngleReTx_deg", "txSubArray")
    delay_s, tilt_deg, array_part = (np.array([sector[name] for sector in sector_infos]) for name in names)
    head = installation.get((SINGLE_HEAD, receiver))
    transmitters = [installation.get((sector["txArrNumber"], receiver), head) for sector in sector_infos]
    return PingSectors(delay_s, tilt_deg, array_part, transmitters)
