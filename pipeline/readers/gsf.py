"""GSF ("Generic Sensor Format Specification", 03.06, Leidos 98-16v), ping by ping; big-endian, times in UTC.

The library gsfu decodes single records (:mod:`pipeline.readers.gsf_pings`). It cannot read a whole file: its index
holds all records and refuses the file at the first damaged one, and its iterator ends there. Therefore
:mod:`pipeline.readers.gsf_records` finds the records.

The specification describes BEAM_ANGLE in two ways: as the "incoming beam angle at transducer face" (table 4-3), and as
the "rotation from vertical" (4.3.4.9). The programs whose files were examined (CARIS HIPS, gsfu's own converter) write
the former, not roll corrected. The flag ROLL_COMPENSATED concerns depths, and is ignored. In these files BEAM_ANGLE is
positive to port, the side of the first beam; the specification does not define the sign. The reader turns the angles to
starboard +.

GSF does not record how the fan was sent. Therefore the fan must be fixed to the boat. A file is refused if its records
show stabilisation of pitch or yaw, tilted sectors, or several receivers or swaths. (Records of Kongsberg's newer sonars
contain this.) A file is also refused if its along-track distances show that the fan is not fixed
(:mod:`pipeline.readers.gsf_fans`). A file without along-track distances cannot be tested.

Most files store angles and times as 16-bit numbers. Some programs let them overflow: an angle then jumps by 65536
steps. A ping is left out if two neighbouring beams lie more than 20 degrees apart, and more than ten times the median
spacing of the ping. Pings and beams with the flag "not usable" are left out too. The sound speed is the one that the
sensor recorded with the ping. Otherwise the speed at the top of the last profile is used, or else session.yaml's.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from pipeline.artefacts.streams import Chunk
from pipeline.errors import RawDataError
from pipeline.readers.gsf_fans import StabilisationTest
from pipeline.readers.gsf_pings import (
    GsfPing,
    GsfScales,
    angles_are_smooth,
    decode_gsf_ping,
    major_version,
    top_of_profile,
)
from pipeline.readers.gsf_records import HEADER, PING, PROFILE, gsf_records
from pipeline.readers.raw_file import opened
from pipeline.readers.repeated_pings import RepeatedPings
from pipeline.readers.row_filter import RowFilter
from pipeline.readers.sounding_chunks import (
    NO_TILT_DEG,
    beam_numbers,
    checked_chunk,
    chunks_of_pings,
    per_sounding,
    single_beam_error,
)


@dataclass(frozen=True)
class _NumberedPing:
    """A ping with its number in the file and the sound speed at the head [m/s]."""

    number: int
    ping: GsfPing
    sound_speed_m_s: float


@dataclass(frozen=True)
class GsfPart:
    """One GSF file. Its pings are numbered from 0, because not every sensor records a ping number."""

    path: Path
    name: str
    sound_speed_m_s: float | None  # from session.yaml, for pings without a recorded sound speed
    latency_s: float

    def chunks(self) -> Iterator[Chunk]:
        """Yield the soundings, chunk by chunk."""
        dropped: Counter[str] = Counter()
        with opened(self.path, self.name) as file:
            yield from chunks_of_pings(
                pings=self._usable_pings(file, dropped),
                n_soundings=lambda numbered: len(numbered.ping.angle_deg),
                chunk_of=lambda group: self._chunk(group, dropped),
                dropped=dropped,
            )

    def _usable_pings(self, file: BinaryIO, dropped: Counter[str]) -> Iterator[_NumberedPing]:
        """Yield each ping with soundings once; raise RawDataError if the file's fans are not fixed to the boat."""
        first: GsfPing | None = None
        stabilisation, repeated = StabilisationTest(), RepeatedPings()
        for number, ping, body, profile_speed_m_s in _pings(file, dropped):
            if ping is None or (ping.missing and number):
                dropped["damaged record" if ping is None else "ping without times or angles"] += 1
                continue
            if ping.missing:
                raise RawDataError(
                    f"{self.name}: its pings have no {ping.missing}, only positions of soundings, and cannot be "
                    "used; export it again with travel times and beam angles, or give the sonar's own files"
                )
            if not repeated.is_new(body, dropped):
                continue
            first = first or ping
            self._refuse_moving_fan(number, ping, first)
            if ping.positions is not None and angles_are_smooth(ping.angle_deg):
                stabilisation.add(ping.positions, ping.usable)
            speed = ping.sound_speed_m_s or profile_speed_m_s or self.sound_speed_m_s
            if speed is None:
                raise RawDataError(
                    f"{self.name}: has no sound speed at the head, neither with its pings nor in a profile; give "
                    "mbes.sound_speed_m_s in session.yaml, the one that its beams were steered with"
                )
            yield _NumberedPing(number, ping, speed)
        stabilisation.refuse_stabilised(self.name)

    def _refuse_moving_fan(self, number: int, ping: GsfPing, first: GsfPing) -> None:
        """Raise RawDataError if the ping's record shows a moving fan, another receiver or swath, or a single beam."""
        if ping.stabilised:
            raise RawDataError(
                f"{self.name}: ping {number} was sent with pitch or yaw stabilisation: its fan has another direction "
                "in each ping, which GSF does not tell; give the sonar's own .kmall or .all, or switch both off and "
                "sail again"
            )
        if abs(ping.tilt_deg) > NO_TILT_DEG:
            raise RawDataError(
                f"{self.name}: ping {number} has sectors tilted by {ping.tilt_deg:.2f} degrees, and GSF does not tell "
                "which way the transmitter looks; give the sonar's own .kmall or .all"
            )
        if not number and len(ping.angle_deg) == 1:
            raise single_beam_error(self.name)
        if ping.receiver_and_swath != first.receiver_and_swath:
            raise RawDataError(
                f"{self.name}: has soundings of several receivers or swaths, each with a mount of its own; log one "
                "head alone, without dual swath"
            )

    @np.errstate(all="ignore")  # damaged numbers are counted, without numpy's warnings
    def _chunk(self, group: list[_NumberedPing], dropped: Counter[str]) -> Chunk:
        pings = [numbered.ping for numbered in group]
        counts = np.array([len(ping.angle_deg) for ping in pings])
        rows = RowFilter(
            {
                "t_ns": per_sounding([ping.t_ns for ping in pings], counts, np.int64),
                "ping": per_sounding([numbered.number for numbered in group], counts, np.int64),
                "beam": beam_numbers(counts),
                "two_way_time_s": np.concatenate([ping.two_way_time_s for ping in pings]),
                "angle_rad": -np.radians(np.concatenate([ping.angle_deg for ping in pings])),
                "transmit_tilt_rad": np.zeros(counts.sum()),
                "sound_speed_m_s": per_sounding([numbered.sound_speed_m_s for numbered in group], counts, np.float64),
                "usable": np.concatenate([ping.usable for ping in pings]),
                "smooth": per_sounding([angles_are_smooth(ping.angle_deg) for ping in pings], counts, bool),
            },
            dropped,
        )
        rows.keep(rows["usable"], "flagged as not usable")
        rows.keep(rows["smooth"], "angles of the ping jump")
        return checked_chunk(rows, self.latency_s)


def _pings(file: BinaryIO, dropped: Counter[str]) -> Iterator[tuple[int, GsfPing | None, bytes, float | None]]:
    """Yield each ping's number, contents (None: damaged) and bytes, and the last profile's sound speed at its top."""
    version, number = 3, -1
    scales: GsfScales = {}
    profile_speed_m_s = None
    for kind, body in gsf_records(file, dropped):
        if kind == HEADER:
            version = major_version(body)
        elif kind == PROFILE:
            profile_speed_m_s = top_of_profile(body)
        elif kind == PING:
            number += 1
            yield number, decode_gsf_ping(body, version, scales), body, profile_speed_m_s
