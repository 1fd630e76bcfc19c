"""The common part of the readers of .kmall and .all: pings of transmit sectors, each with its own tilt and time."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.gps_time import NS
from pipeline.readers.kongsberg_arrays import COINCIDENT_TRANSMITTER, SectorSoundings, Transmitter
from pipeline.readers.raw_file import opened
from pipeline.readers.row_filter import RowFilter
from pipeline.readers.sounding_chunks import (
    NO_TILT_DEG,
    beam_numbers,
    checked_chunk,
    chunks_of_pings,
    per_sounding,
    single_beam_error,
)

MAX_TILT_DEG = 45.0
Array = NDArray[np.float64]


@dataclass(frozen=True)
class PingSectors:
    """A ping's transmit sectors (n,).

    Parameters
    ----------
    delay_s
        Times at which the sectors were sent, s after the ping's time.
    tilt_deg
        Tilts in the transmitters' own frames, forward +.
    array_part
        Numbers of the transmitters' parts that sent the sectors.
    transmitters
        The sectors' transmitters; None: the file does not say how the transmitter is mounted.
    """

    delay_s: Array
    tilt_deg: Array
    array_part: NDArray[np.int64]
    transmitters: Sequence[Transmitter | None]


@dataclass(frozen=True)
class KongsbergPing:
    """All soundings (n,) of one datagram; angles in degrees, port +."""

    t_ns: int
    number: int
    receiver: str
    sound_speed_m_s: float
    sectors: PingSectors
    sector: NDArray[np.integer[Any]]
    extra: NDArray[np.bool_]
    rejected: NDArray[np.bool_]
    angle_deg: Array
    two_way_time_s: Array


def are_possible(sectors: PingSectors, sector: NDArray[np.integer[Any]]) -> bool:
    """Return whether delays and tilts are possible, and each sounding's ``sector`` (n,) is one of the ``sectors``."""
    delays, tilts = np.abs(sectors.delay_s), np.abs(sectors.tilt_deg)
    all_exist = not len(sector) or int(sector.max()) < len(sectors.transmitters)
    return bool(np.all(delays < 1) and np.all(tilts < MAX_TILT_DEG) and all_exist)


@dataclass(frozen=True)
class KongsbergPart(ABC):
    """One file; ``projector_offset_m`` of session.yaml, if not None, replaces the transmitter's centre in the file."""

    path: Path
    name: str
    latency_s: float
    projector_offset_m: tuple[float, float, float] | None = None

    @abstractmethod
    def _pings(self, file: BinaryIO, dropped: Counter[str]) -> Iterator[KongsbergPing]:
        """Yield the file's pings; count damaged datagrams in ``dropped``."""

    def chunks(self) -> Iterator[Chunk]:
        """Yield the soundings, chunk by chunk."""
        dropped: Counter[str] = Counter()
        with opened(self.path, self.name) as file:
            yield from chunks_of_pings(
                pings=self._usable_pings(file, dropped),
                n_soundings=lambda ping: len(ping.sector),
                chunk_of=lambda pings: self._chunk(pings, dropped),
                dropped=dropped,
            )

    def _usable_pings(self, file: BinaryIO, dropped: Counter[str]) -> Iterator[KongsbergPing]:
        first: KongsbergPing | None = None
        for ping in self._pings(file, dropped):
            first = first or ping
            self._refuse_unusable(ping, first)
            yield ping

    def _refuse_unusable(self, ping: KongsbergPing, first: KongsbergPing) -> None:
        """Raise RawDataError for a ping that has no use.

        It comes from a second receiver; or it is the first ping and has a single beam; or a sector is tilted, and the
        file does not say how its transmitter is mounted.
        """
        if ping.receiver != first.receiver:
            raise RawDataError(
                f"{self.name}: has soundings of several receivers (dual head), each with a mount of its own; "
                "log one head alone"
            )
        if ping is first and len(ping.sector) == 1:
            raise single_beam_error(self.name)
        for tilt, transmitter in zip(ping.sectors.tilt_deg, ping.sectors.transmitters, strict=True):
            if transmitter is None and abs(tilt) > NO_TILT_DEG:
                raise RawDataError(
                    f"{self.name}: its sectors are tilted ({tilt:.2f} degrees), but it does not tell how the "
                    "transmitter is mounted against the receiver, without which forward may be aft; give the file as "
                    "the sonar's program wrote it, with its installation at the beginning"
                )

    @np.errstate(all="ignore")  # damaged numbers are counted, without numpy's warnings
    def _chunk(self, pings: list[KongsbergPing], dropped: Counter[str]) -> Chunk:
        counts = np.array([len(ping.sector) for ping in pings])

        def joined(values: Callable[[KongsbergPing], NDArray[Any]]) -> NDArray[Any]:
            return np.concatenate([values(ping) for ping in pings])

        axis_mbes, part_mbes_m, centre_mbes_m = joined(self._axes_and_positions).swapaxes(0, 1)
        recorded = SectorSoundings(
            angle_rad=-np.radians(joined(lambda ping: ping.angle_deg)),
            tilt_rad=np.radians(joined(lambda ping: ping.sectors.tilt_deg[ping.sector])),
            axis_mbes=axis_mbes,
            part_mbes_m=part_mbes_m,
            centre_mbes_m=centre_mbes_m,
            two_way_time_s=joined(lambda ping: ping.two_way_time_s),
            sound_speed_m_s=per_sounding([ping.sound_speed_m_s for ping in pings], counts, np.float64),
        )
        angle_rad, tilt_rad, time_s = recorded.in_mbes(self.projector_offset_m)
        has_values = np.isfinite(recorded.angle_rad) & np.isfinite(recorded.two_way_time_s)
        delay_ns = joined(lambda ping: np.rint(ping.sectors.delay_s * NS).astype(np.int64)[ping.sector])
        rows = RowFilter(
            {
                "t_ns": per_sounding([ping.t_ns for ping in pings], counts, np.int64) + delay_ns,
                "ping": per_sounding([ping.number for ping in pings], counts, np.int64),
                "beam": beam_numbers(counts),
                "two_way_time_s": time_s,
                "angle_rad": angle_rad,
                "transmit_tilt_rad": tilt_rad,
                "sound_speed_m_s": recorded.sound_speed_m_s,
                "extra": joined(lambda ping: ping.extra),
                "rejected": joined(lambda ping: ping.rejected),
                "intersects": np.isfinite(tilt_rad) & np.isfinite(time_s) | ~has_values,
            },
            dropped,
        )
        rows.keep(~rows["extra"], "extra detection")
        rows.keep(~rows["rejected"], "rejected detection")
        rows.keep(rows["intersects"], "beam, fan and range do not meet")
        return checked_chunk(rows, self.latency_s)

    def _axes_and_positions(self, ping: KongsbergPing) -> NDArray[Any]:
        """Return per sounding three rows (n, 3, 3): transmitter's axis, position of the sending part, of the centre."""
        by_sector = [
            (transmitter or COINCIDENT_TRANSMITTER).axis_and_positions(
                int(part), self.projector_offset_m if transmitter else None
            )
            for part, transmitter in zip(ping.sectors.array_part, ping.sectors.transmitters, strict=True)
        ]
        return np.asarray(np.array(by_sector).reshape(-1, 3, 3)[ping.sector])
