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
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RawDataError
from pipeline.readers.files import opened
from pipeline.readers.kmall_datagrams import HEAD, IIP, LENGTH, datagrams
from pipeline.readers.kongsberg_arrays import NO_TILT_DEG, SAME, Array, Arrays, Fan, not_told, of_kmall
from pipeline.readers.sieve import MBES_COLUMNS, Sieve, chunk, keep_possible_soundings, latency_ns, no_rows, possible_ns
from pipeline.streams import Chunk
from pipeline.times import NS, gps_ns_from_unix_utc

SOUNDINGS = 131_072  # a chunk has at least so many, and at most one ping more
PINGS = 8_192
LEAST_MRZ = 200  # its heads alone are longer
MAX_BEAMS = np.iinfo(np.int16).max
MAX_TILT_DEG = 45.0
SOUNDING = 88  # bytes of one that are needed
NORMAL, EXTRA, REJECTED = 0, 1, 2


class Sectors(NamedTuple):
    """A ping's, (n,) each: delay, tilt in the transmitter's own frame (forward +), number of the transmitter and of its
    part."""

    delay_s: NDArray[np.float64]
    tilt_deg: NDArray[np.float64]
    transmitter: NDArray[np.int64]
    part: NDArray[np.int64]


class Ping(NamedTuple):
    """One datagram's soundings, all of them."""

    t_ns: int
    number: int
    receiver: int
    sound_speed_m_s: float
    sectors: Sectors
    sector: NDArray[np.uint8]
    kind: NDArray[np.uint8]
    angle_deg: NDArray[np.float64]
    two_way_time_s: NDArray[np.float64]


@dataclass(frozen=True)
class KmallPart:
    """One file. ``projector_offset_m``: as session.yaml gives it; else the file's own is taken."""

    path: Path
    name: str
    latency_s: float
    projector_offset_m: tuple[float, float, float] | None = None

    def chunks(self) -> Iterator[Chunk]:
        dropped: Counter[str] = Counter()
        pings: list[Ping] = []
        waiting = 0
        first: Ping | None = None
        arrays: dict[tuple[int, int], Arrays] = {}
        with opened(self.path, self.name) as file:
            for datagram in datagrams(file, dropped):
                if datagram[4:8] == IIP:
                    arrays |= of_kmall(datagram.decode("latin-1"))
                    continue
                ping = decode(datagram)
                if ping is None:
                    dropped["damaged datagram"] += 1
                    continue
                first = first or ping
                self._refuse_other_heads(ping, first)
                pings.append(ping)
                waiting += len(ping.kind)
                if waiting >= SOUNDINGS or len(pings) >= PINGS:
                    yield self._chunk(pings, arrays, dropped)
                    pings, waiting = [], 0
            if waiting:
                yield self._chunk(pings, arrays, dropped)
            if dropped:
                yield no_rows(MBES_COLUMNS, dropped)

    def _refuse_other_heads(self, ping: Ping, first: Ping) -> None:
        if ping.receiver != first.receiver:
            raise RawDataError(
                f"{self.name}: has soundings of several receivers (dual head), each with a mount of its own; "
                "log one head alone"
            )
        if ping is first and len(ping.kind) == 1:
            raise RawDataError(
                f"{self.name}: its pings are of one beam (a single-beam echo sounder), which sees no planes; give the "
                "files of a multibeam sonar"
            )

    @np.errstate(all="ignore")  # damaged numbers are counted, not warned of
    def _chunk(self, pings: list[Ping], arrays: dict[tuple[int, int], Arrays], dropped: Counter[str]) -> Chunk:
        counts = np.array([len(ping.kind) for ping in pings])

        def spread(values: Any, dtype: Any) -> NDArray[Any]:
            return np.repeat(np.asarray(values, dtype=dtype), counts)

        def joined(values: Callable[[Ping], NDArray[Any]]) -> NDArray[Any]:
            return np.concatenate([values(ping) for ping in pings])

        rows = np.concatenate([self._transmitters(ping, arrays)[ping.sector] for ping in pings])
        axis, part, centre = rows.swapaxes(0, 1)
        fan = Fan(
            angle_rad=-np.radians(joined(lambda ping: ping.angle_deg)),
            tilt_rad=np.radians(joined(lambda ping: ping.sectors.tilt_deg[ping.sector])),
            axis=axis,
            part_m=part,
            centre_m=centre,
            two_way_time_s=joined(lambda ping: ping.two_way_time_s),
            sound_speed_m_s=spread([ping.sound_speed_m_s for ping in pings], np.float64),
        )
        angle_rad, tilt_rad, time_s = fan.in_mbes(self.projector_offset_m)
        delay_ns = joined(lambda ping: np.rint(ping.sectors.delay_s * NS).astype(np.int64)[ping.sector])
        sieve = Sieve(
            {
                "t_ns": spread([ping.t_ns for ping in pings], np.int64) + delay_ns,
                "ping": spread([ping.number for ping in pings], np.int64),
                "beam": np.concatenate([np.arange(count, dtype=np.int16) for count in counts]),
                "two_way_time_s": time_s,
                "angle_rad": angle_rad,
                "transmit_tilt_rad": tilt_rad,
                "sound_speed_m_s": fan.sound_speed_m_s,
                "kind": joined(lambda ping: ping.kind),
            },
            dropped,
        )
        sieve.keep(sieve["kind"] != EXTRA, "extra detection")
        sieve.keep(sieve["kind"] == NORMAL, "rejected detection")
        sieve.keep(possible_ns(sieve["t_ns"]), "impossible time (clock not set)")
        keep_possible_soundings(sieve)
        sieve.columns["t_ns"] = sieve["t_ns"] - latency_ns(self.latency_s)
        return chunk(sieve.columns, MBES_COLUMNS, dropped)

    def _transmitters(self, ping: Ping, arrays: dict[tuple[int, int], Arrays]) -> Array:
        """Of each sector (n, 3, 3): its transmitter's axis, its part's place, its centre's."""
        found = []
        for tilt, transmitter, part in zip(*ping.sectors[1:], strict=True):
            pair = arrays.get((int(transmitter), ping.receiver)) or arrays.get((ping.receiver, ping.receiver))
            if pair is None and abs(tilt) > NO_TILT_DEG:
                raise RawDataError(not_told(self.name, float(tilt)))
            found.append((pair or SAME).of_part(int(part), self.projector_offset_m if pair else None))
        return np.array(found).reshape(-1, 3, 3)


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
        sectors = _sectors(reader, info)
        receiver = reader.read_EMdgmMRZ_rxInfo()
    except (struct.error, ValueError, OverflowError, OSError):
        return None
    step = receiver["numBytesPerSounding"]
    count = receiver["numSoundingsMaxMain"] + receiver["numExtraDetections"]
    start = reader.FID.tell() + receiver["numExtraDetectionClasses"] * receiver["numBytesPerClass"]
    if partition["numOfDgms"] != 1 or nanoseconds >= NS or step < SOUNDING or count > MAX_BEAMS:
        return None
    if sectors is None or start + count * step > len(datagram) - LENGTH.size:
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
    if count and soundings["sector"].max() >= len(sectors.delay_s):
        return None
    t_ns = gps_ns_from_unix_utc(np.array([seconds]), np.array([nanoseconds]))[0]
    return Ping(
        int(t_ns),
        common["pingCnt"],
        common["rxTransducerInd"],
        info["soundSpeedAtTxDepth_mPerSec"],
        sectors,
        soundings["sector"],
        soundings["kind"],
        soundings["angle"].astype(np.float64),
        soundings["time"].astype(np.float64),
    )


def _sectors(reader: Any, info: dict[str, Any]) -> Sectors | None:
    """The sectors, by their numbers; None where their delays or tilts are impossible."""
    found = []
    start = reader.FID.tell()
    for number in range(min(info["numTxSectors"], 256)):
        reader.FID.seek(start + number * info["numBytesPerTxSector"])
        found.append(reader.read_EMdgmMRZ_txSectorInfo())
    reader.FID.seek(start + info["numTxSectors"] * info["numBytesPerTxSector"])
    names = ("sectorTransmitDelay_sec", "tiltAngleReTx_deg", "txArrNumber", "txSubArray")
    delay, tilt, transmitter, part = (np.array([one[name] for one in found]) for name in names)
    possible = np.all(np.abs(delay) < 1) and np.all(np.abs(tilt) < MAX_TILT_DEG)
    return Sectors(delay, tilt, transmitter, part) if possible else None
