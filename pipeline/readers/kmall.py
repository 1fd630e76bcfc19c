"""Kongsberg .kmall: the soundings of #MRZ datagrams ("KMALL datagram description", 410224; little-endian).

pykmall decodes a datagram's heads, each from its own bytes. It does not lead through the file: its index and scan
print, hold all of the file's index, end with whatever exception at the first damaged datagram, and may not end at all;
and it makes a dictionary of each sounding, blind to the size that the datagram gives for one. So datagrams are found by
:mod:`pipeline.readers.kmall_datagrams`, and the soundings of one are read at once.

Of a sounding, offsets in bytes: 2 u8 transmit sector, 3 u8 type (0 normal, 1 extra, 2 rejected), 72 f32 angle to the
array [degrees], 80 f32 two-way travel time [s]; corrections at 76 and 84 are applied in them already. Time is the
datagram's, that of the first sector, and the delay of the sounding's own sector. Angles are positive to port, as is the
sign of the sectors' edges (port +, starboard -); here starboard +. The sound speed is that at the transducer's depth.

The frame ``mbes`` is that of the receiver's array, which the beam angles refer to: the angles of the installation
(#IIP, TRAI_RX) are not applied, and the mount found stands in their place; the yaw of an array mounted the other way
round is near 180 degrees. Each sector is tilted along track by itself (txSectorInfo, tiltAngleReTx: the steering of the
main lobe as sent, in the transmitter's own frame), and sends from its own part of the transmitter: both are turned into
the frame ``mbes`` by the installation (:mod:`pipeline.readers.kongsberg_arrays`). The tilt holds whatever steered the
sector: stabilisation of pitch or yaw, the swath of a dual swath, the mode of a ping. Of two receivers only one can be
calibrated; pings of a single beam are no fan.
"""

import io
import struct
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np

from pipeline.gps_time import NS, gps_ns_from_unix_utc
from pipeline.readers.kmall_datagrams import HEAD, IIP, LENGTH, datagrams
from pipeline.readers.kongsberg import MAX_BEAMS, KongsbergPart, Ping, Sectors, possible
from pipeline.readers.kongsberg_arrays import ONE_HEAD, Arrays, of_kmall
from pipeline.readers.repeated_pings import Repeats

LEAST_MRZ = 200  # its heads alone are longer
SOUNDING = 88  # bytes of one that are needed
NORMAL, EXTRA, REJECTED = 0, 1, 2
Installation = Mapping[tuple[int, int], Arrays]  # by transmitter and receiver


@dataclass(frozen=True)
class KmallPart(KongsbergPart):
    """One file."""

    def _pings(self, file: BinaryIO, dropped: Counter[str]) -> Iterator[Ping]:
        installation: Installation = {}
        repeats = Repeats()
        for datagram in datagrams(file, dropped):
            if datagram[4:8] == IIP:
                installation = of_kmall(datagram.decode("latin-1"))
            elif (ping := decode(datagram, installation)) is not None:
                if repeats.is_new(datagram, dropped):
                    yield ping
            else:
                dropped["damaged datagram"] += 1


@np.errstate(all="ignore")  # damaged numbers are counted, not warned of
def decode(datagram: bytes, installation: Installation) -> Ping | None:
    """The contents of one #MRZ datagram; None where they contradict themselves, or are one part of several."""
    from KMALL import kmall

    if len(datagram) < LEAST_MRZ:
        return None
    reader: Any = kmall()
    reader.FID = io.BytesIO(datagram)
    try:
        _, _, _, _, _, seconds, nanoseconds = HEAD.unpack_from(datagram)
        reader.read_EMdgmHeader()
        partition = reader.read_EMdgmMpartition()
        common = reader.read_EMdgmMbody()
        info = reader.read_EMdgmMRZ_pingInfo()
        told = _sectors(reader, info)
        receiver = reader.read_EMdgmMRZ_rxInfo()
    except (struct.error, ValueError, OverflowError, OSError):
        return None
    step = receiver["numBytesPerSounding"]
    count = receiver["numSoundingsMaxMain"] + receiver["numExtraDetections"]
    start = reader.FID.tell() + receiver["numExtraDetectionClasses"] * receiver["numBytesPerClass"]
    if partition["numOfDgms"] != 1 or nanoseconds >= NS or step < SOUNDING or count > MAX_BEAMS:
        return None
    if start + count * step > len(datagram) - LENGTH.size:
        return None
    layout = np.dtype(
        {
            "names": ["sector", "kind", "angle", "time"],
            "formats": ["u1", "u1", "<f4", "<f4"],
            "offsets": [2, 3, 72, 80],
            "itemsize": step,
        }
    )
    soundings = np.frombuffer(datagram, layout, count, start)
    sectors = _of_installation(told, common["rxTransducerInd"], installation)
    if not possible(sectors, soundings["sector"]):
        return None
    t_ns = gps_ns_from_unix_utc(np.array([seconds]), np.array([nanoseconds]))[0]
    return Ping(
        int(t_ns),
        common["pingCnt"],
        str(common["rxTransducerInd"]),
        info["soundSpeedAtTxDepth_mPerSec"],
        sectors,
        soundings["sector"],
        soundings["kind"] == EXTRA,
        soundings["kind"] >= REJECTED,
        soundings["angle"].astype(np.float64),
        soundings["time"].astype(np.float64),
    )


def _sectors(reader: Any, info: dict[str, Any]) -> list[dict[str, Any]]:
    found = []
    start = reader.FID.tell()
    for number in range(min(info["numTxSectors"], 256)):
        reader.FID.seek(start + number * info["numBytesPerTxSector"])
        found.append(reader.read_EMdgmMRZ_txSectorInfo())
    reader.FID.seek(start + info["numTxSectors"] * info["numBytesPerTxSector"])
    return found


def _of_installation(told: list[dict[str, Any]], receiver: int, installation: Installation) -> Sectors:
    """By their numbers; a head of both arrays has one number."""
    names = ("sectorTransmitDelay_sec", "tiltAngleReTx_deg", "txSubArray")
    delay, tilt, part = (np.array([sector[name] for sector in told]) for name in names)
    one_head = installation.get((ONE_HEAD, receiver))
    arrays = [installation.get((sector["txArrNumber"], receiver), one_head) for sector in told]
    return Sectors(delay, tilt, part, arrays)
