"""What .kmall and .all have in common: pings of transmit sectors, each tilted by itself and sent at its own time."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.gps_time import NS
from pipeline.readers.kongsberg_arrays import SAME, Arrays, Fan
from pipeline.readers.raw_file import opened
from pipeline.readers.row_checks import (
    MBES_COLUMNS,
    RowFilter,
    chunk,
    keep_possible_soundings,
    latency_ns,
    no_rows,
    possible_ns,
)

SOUNDINGS = 131_072  # a chunk has at least so many, and at most one ping more
PINGS = 8_192
MAX_BEAMS = np.iinfo(np.int16).max
MAX_TILT_DEG = 45.0
NO_TILT_DEG = 0.005
Array = NDArray[np.float64]


class Sectors(NamedTuple):
    """A ping's, (n,) each: delay, tilt in the transmitter's own frame (forward +), number of the part that sent; and
    the transmitter, None where the file does not tell how it is mounted."""

    delay_s: Array
    tilt_deg: Array
    part: NDArray[np.int64]
    arrays: Sequence[Arrays | None]


class Ping(NamedTuple):
    """One datagram's soundings, all of them; angles in degrees, port +."""

    t_ns: int
    number: int
    receiver: str
    sound_speed_m_s: float
    sectors: Sectors
    sector: NDArray[np.integer[Any]]
    extra: NDArray[np.bool_]
    rejected: NDArray[np.bool_]
    angle_deg: Array
    two_way_time_s: Array


def possible(sectors: Sectors, sector: NDArray[np.integer[Any]]) -> bool:
    """Whether delays and tilts are, and each sounding's sector is one of them."""
    delays, tilts = np.abs(sectors.delay_s), np.abs(sectors.tilt_deg)
    numbered = not len(sector) or int(sector.max()) < len(sectors.arrays)
    return bool(np.all(delays < 1) and np.all(tilts < MAX_TILT_DEG) and numbered)


@dataclass(frozen=True)
class KongsbergPart(ABC):
    """One file. ``projector_offset_m``: as session.yaml gives it; else the file's own is taken."""

    path: Path
    name: str
    latency_s: float
    projector_offset_m: tuple[float, float, float] | None = None

    @abstractmethod
    def _pings(self, file: BinaryIO, dropped: Counter[str]) -> Iterator[Ping]:
        """The file's pings; what is damaged is counted."""

    def chunks(self) -> Iterator[Chunk]:
        dropped: Counter[str] = Counter()
        pings: list[Ping] = []
        waiting = 0
        first: Ping | None = None
        with opened(self.path, self.name) as file:
            for ping in self._pings(file, dropped):
                first = first or ping
                self._refuse(ping, first)
                pings.append(ping)
                waiting += len(ping.sector)
                if waiting >= SOUNDINGS or len(pings) >= PINGS:
                    yield self._chunk(pings, dropped)
                    pings, waiting = [], 0
            if waiting:
                yield self._chunk(pings, dropped)
            if dropped:
                yield no_rows(MBES_COLUMNS, dropped)

    def _refuse(self, ping: Ping, first: Ping) -> None:
        if ping.receiver != first.receiver:
            raise RawDataError(
                f"{self.name}: has soundings of several receivers (dual head), each with a mount of its own; "
                "log one head alone"
            )
        if ping is first and len(ping.sector) == 1:
            raise RawDataError(
                f"{self.name}: its pings are of one beam (a single-beam echo sounder), which sees no planes; give the "
                "files of a multibeam sonar"
            )
        for tilt, known in zip(ping.sectors.tilt_deg, ping.sectors.arrays, strict=True):
            if known is None and abs(tilt) > NO_TILT_DEG:
                raise RawDataError(
                    f"{self.name}: its sectors are tilted ({tilt:.2f} degrees), but it does not tell how the "
                    "transmitter is mounted against the receiver, without which forward may be aft; give the file as "
                    "the sonar's program wrote it, with its installation at the beginning"
                )

    @np.errstate(all="ignore")  # damaged numbers are counted, not warned of
    def _chunk(self, pings: list[Ping], dropped: Counter[str]) -> Chunk:
        counts = np.array([len(ping.sector) for ping in pings])

        def spread(values: Any, dtype: Any) -> NDArray[Any]:
            return np.repeat(np.asarray(values, dtype=dtype), counts)

        def joined(values: Callable[[Ping], NDArray[Any]]) -> NDArray[Any]:
            return np.concatenate([values(ping) for ping in pings])

        axis, part, centre = joined(self._transmitters).swapaxes(0, 1)
        speed = spread([ping.sound_speed_m_s for ping in pings], np.float64)
        fan = Fan(
            angle_rad=-np.radians(joined(lambda ping: ping.angle_deg)),
            tilt_rad=np.radians(joined(lambda ping: ping.sectors.tilt_deg[ping.sector])),
            axis=axis,
            part_m=part,
            centre_m=centre,
            two_way_time_s=joined(lambda ping: ping.two_way_time_s),
            sound_speed_m_s=speed,
        )
        angle_rad, tilt_rad, time_s = fan.in_mbes(self.projector_offset_m)
        recorded = np.isfinite(fan.angle_rad) & np.isfinite(fan.two_way_time_s)
        delay_ns = joined(lambda ping: np.rint(ping.sectors.delay_s * NS).astype(np.int64)[ping.sector])
        sieve = RowFilter(
            {
                "t_ns": spread([ping.t_ns for ping in pings], np.int64) + delay_ns,
                "ping": spread([ping.number for ping in pings], np.int64),
                "beam": np.concatenate([np.arange(count, dtype=np.int16) for count in counts]),
                "two_way_time_s": time_s,
                "angle_rad": angle_rad,
                "transmit_tilt_rad": tilt_rad,
                "sound_speed_m_s": speed,
                "extra": joined(lambda ping: ping.extra),
                "rejected": joined(lambda ping: ping.rejected),
                "placed": np.isfinite(tilt_rad) & np.isfinite(time_s) | ~recorded,
            },
            dropped,
        )
        sieve.keep(~sieve["extra"], "extra detection")
        sieve.keep(~sieve["rejected"], "rejected detection")
        sieve.keep(sieve["placed"], "beam, fan and range do not meet")
        sieve.keep(possible_ns(sieve["t_ns"]), "impossible time (clock not set)")
        keep_possible_soundings(sieve)
        sieve.columns["t_ns"] = sieve["t_ns"] - latency_ns(self.latency_s)
        return chunk(sieve.columns, MBES_COLUMNS, dropped)

    def _transmitters(self, ping: Ping) -> NDArray[Any]:
        """Of each sounding (n, 3, 3): its transmitter's axis, its part's place, its centre's."""
        given = self.projector_offset_m
        found = [
            (known or SAME).of_part(int(part), given if known else None)
            for part, known in zip(ping.sectors.part, ping.sectors.arrays, strict=True)
        ]
        return np.asarray(np.array(found).reshape(-1, 3, 3)[ping.sector])
