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
round is near 180 degrees. The transmit fan lies where it is steered: with pitch or yaw stabilisation its direction
follows the boat and is another for each ping, so such files are refused. A fixed tilt is part of the mount's pitch.
Both swaths of a dual swath are tilted differently and refused too; of two receivers only one can be calibrated.
"""

import io
import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.readers.files import opened
from pipeline.readers.kmall_datagrams import HEAD, LENGTH, datagrams
from pipeline.readers.sieve import MBES_COLUMNS, Sieve, chunk, keep_possible_soundings, latency_ns, no_rows, possible_ns
from pipeline.streams import Chunk
from pipeline.times import NS, gps_ns_from_unix_utc

SOUNDINGS = 131_072  # a chunk has at least so many, and at most one ping more
PINGS = 8_192
LEAST_MRZ = 200  # its heads alone are longer
MAX_BEAMS = np.iinfo(np.int16).max
SOUNDING = 88  # bytes of one that are needed
NORMAL, EXTRA, REJECTED = 0, 1, 2
STABILISED = 0b11  # modeAndStabilisation: pitch, yaw


class Ping(NamedTuple):
    """One datagram's soundings, all of them."""

    t_ns: int
    number: int
    receiver: int
    swath: int
    stabilised: bool
    sound_speed_m_s: float
    delay_ns: NDArray[np.int64]
    kind: NDArray[np.uint8]
    angle_deg: NDArray[np.float64]
    two_way_time_s: NDArray[np.float64]


@dataclass(frozen=True)
class KmallPart:
    """One file."""

    path: Path
    name: str
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        dropped: Counter[str] = Counter()
        pings: list[Ping] = []
        waiting = 0
        first: Ping | None = None
        with opened(self.path, self.name) as file:
            for datagram in datagrams(file, dropped):
                ping = decode(datagram)
                if ping is None:
                    dropped["damaged datagram"] += 1
                    continue
                first = first or ping
                self._refuse_other_heads(ping, first)
                pings.append(ping)
                waiting += len(ping.kind)
                if waiting >= SOUNDINGS or len(pings) >= PINGS:
                    yield _chunk(pings, self.latency_s, dropped)
                    pings, waiting = [], 0
            if waiting:
                yield _chunk(pings, self.latency_s, dropped)
            if dropped:
                yield no_rows(MBES_COLUMNS, dropped)

    def _refuse_other_heads(self, ping: Ping, first: Ping) -> None:
        if ping.stabilised:
            raise RawDataError(
                f"{self.name}: ping {ping.number} was sent with pitch or yaw stabilisation: its fan has another "
                "direction in each ping; switch both off and sail again"
            )
        if ping.swath != first.swath:
            raise RawDataError(
                f"{self.name}: has several swaths a ping (dual swath), each tilted differently; switch it off and sail "
                "again"
            )
        if ping.receiver != first.receiver:
            raise RawDataError(
                f"{self.name}: has soundings of several receivers (dual head), each with a mount of its own; "
                "log one head alone"
            )


@np.errstate(all="ignore")  # damaged numbers are counted, not warned of
def decode(datagram: bytes) -> Ping | None:
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
        delays = _sectors(reader, info)
        receiver = reader.read_EMdgmMRZ_rxInfo()
    except (struct.error, ValueError, OverflowError, OSError):
        return None
    step = receiver["numBytesPerSounding"]
    count = receiver["numSoundingsMaxMain"] + receiver["numExtraDetections"]
    start = reader.FID.tell() + receiver["numExtraDetectionClasses"] * receiver["numBytesPerClass"]
    if partition["numOfDgms"] != 1 or nanoseconds >= NS or step < SOUNDING or count > MAX_BEAMS:
        return None
    if delays is None or start + count * step > len(datagram) - LENGTH.size:
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
    if count and soundings["sector"].max() >= len(delays):
        return None
    t_ns = gps_ns_from_unix_utc(np.array([seconds]), np.array([nanoseconds]))[0]
    return Ping(
        int(t_ns),
        common["pingCnt"],
        common["rxTransducerInd"],
        common["swathAlongPosition"],
        bool(info["modeAndStabilisation"] & STABILISED),
        info["soundSpeedAtTxDepth_mPerSec"],
        np.rint(delays * NS).astype(np.int64)[soundings["sector"]],
        soundings["kind"],
        soundings["angle"].astype(np.float64),
        soundings["time"].astype(np.float64),
    )


def _sectors(reader: Any, info: dict[str, Any]) -> NDArray[np.float64] | None:
    """Transmit delays of the sectors [s], by their numbers; None where they are impossible."""
    delays = []
    start = reader.FID.tell()
    for number in range(min(info["numTxSectors"], 256)):
        reader.FID.seek(start + number * info["numBytesPerTxSector"])
        delays.append(reader.read_EMdgmMRZ_txSectorInfo()["sectorTransmitDelay_sec"])
    reader.FID.seek(start + info["numTxSectors"] * info["numBytesPerTxSector"])
    found = np.array(delays, dtype=np.float64)
    return found if np.all(np.abs(found) < 1) else None


@np.errstate(all="ignore")  # damaged numbers are counted, not warned of
def _chunk(pings: list[Ping], latency_s: float, dropped: Counter[str]) -> Chunk:
    counts = np.array([len(ping.kind) for ping in pings])

    def spread(values: Any, dtype: Any) -> NDArray[Any]:
        return np.repeat(np.asarray(values, dtype=dtype), counts)

    kind = np.concatenate([ping.kind for ping in pings])
    sieve = Sieve(
        {
            "t_ns": spread([ping.t_ns for ping in pings], np.int64) + np.concatenate([ping.delay_ns for ping in pings]),
            "ping": spread([ping.number for ping in pings], np.int64),
            "beam": np.concatenate([np.arange(count, dtype=np.int16) for count in counts]),
            "two_way_time_s": np.concatenate([ping.two_way_time_s for ping in pings]),
            "angle_rad": -np.radians(np.concatenate([ping.angle_deg for ping in pings])),
            "transmit_tilt_rad": np.zeros(counts.sum()),
            "sound_speed_m_s": spread([ping.sound_speed_m_s for ping in pings], np.float64),
            "kind": kind,
        },
        dropped,
    )
    sieve.keep(sieve["kind"] != EXTRA, "extra detection")
    sieve.keep(sieve["kind"] == NORMAL, "rejected detection")
    sieve.keep(possible_ns(sieve["t_ns"]), "impossible time (clock not set)")
    keep_possible_soundings(sieve)
    sieve.columns["t_ns"] = sieve["t_ns"] - latency_ns(latency_s)
    return chunk(sieve.columns, MBES_COLUMNS, dropped)
