"""The scans of an E57 file, and their points as stored. A process of its own reads both.

libE57Format opens a file only after :mod:`pipeline.readers.e57_xml` has checked its header and its XML part.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.artefacts.streams import BATCH_ROWS
from pipeline.errors import RawDataError
from pipeline.maths.geometry.rotations import rotation_from_quaternion
from pipeline.readers import e57_xml
from pipeline.readers.crs import Array
from pipeline.readers.decoder_process import REMEDY, DecodedColumns, decoded_batches, decoded_text

E57_WORKER = Path(__file__).with_name("e57_worker.py")
MAX_TEXT = 1 << 24  # bytes


@dataclass(frozen=True)
class E57Scan:
    """One scan as the file describes it: the fields of the worker's JSON."""

    points: int
    timed: bool  # points have time stamps
    axes: str  # cartesian or spherical; empty: no coordinates
    single: bool  # coordinates in single precision
    start_s: float  # acquisitionStart, seconds since the GPS epoch
    atomic: bool  # the scanner's clock was set by GPS
    rotation: list[float]  # quaternion w, x, y, z of the scan's pose
    translation: list[float]  # m


def read_scans(path: Path, name: str) -> tuple[list[E57Scan], str]:
    """Return the scans, and the CRS that the file declares (WKT, or empty)."""
    e57_xml.check_header_and_xml(path, name)
    try:
        description: dict[str, Any] = json.loads(decoded_text(E57_WORKER, [str(path)], name, MAX_TEXT))
    except ValueError as error:
        raise RawDataError(f"{name}: is damaged ({error}); {REMEDY}") from error
    scans = [E57Scan(**scan) for scan in description["scans"]]
    if not scans:
        raise RawDataError(f"{name}: has no scans; {REMEDY}")
    return scans, description["crs"]


def stored_points(path: Path, name: str, number: int) -> Iterator[DecodedColumns]:
    """Return an iterator over a scan's points as stored, in batches of at most BATCH_ROWS.

    Parameters
    ----------
    path : Path
        The E57 file.
    name : str
        Its path in the session folder, for messages.
    number : int
        Number of the scan, from 0.

    Returns
    -------
    iterator over tuples of six (n,) arrays
        Seconds, three coordinates, marks of invalid points and of invalid times (not 0: invalid).
    """
    e57_xml.check_header_and_xml(path, name)  # checked again: the file may have been replaced
    return decoded_batches(E57_WORKER, [str(path), str(number), str(BATCH_ROWS)], name, 6, BATCH_ROWS)


@np.errstate(all="ignore")
def file_coordinates(decoded: DecodedColumns, scan: E57Scan) -> tuple[Array, Array, Array]:
    """Return a scan's points as stored as Cartesian x, y, z (m) in the file's frame, transformed by the scan's pose."""
    x, y, z = decoded[1:4]
    if scan.axes == "spherical":
        distance, azimuth, elevation = x, y, z
        horizontal = distance * np.cos(elevation)
        x, y, z = horizontal * np.cos(azimuth), horizontal * np.sin(azimuth), distance * np.sin(elevation)
    quaternion = np.array(scan.rotation) / np.linalg.norm(scan.rotation)
    x, y, z = rotation_from_quaternion(quaternion) @ np.array([x, y, z]) + np.array(scan.translation)[:, None]
    return x, y, z
