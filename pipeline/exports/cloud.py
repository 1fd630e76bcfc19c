"""The calibrated points of both sensors as LAS or LAZ, batch by batch, each with its face and its distance from it.

The points are those that the calibration used: labelled by the target's faces. They lie where the calibrated mount, the
INS's poses and their estimated slow errors put them, in the pool frame or in a CRS. Extra dimensions: ``residual_mm``,
the distance from the adjusted surface along its normal (toward the boat, or up), and ``face``, the number of the face,
whose name stands in a record of the header. What is estimated beside the mount, such as biases of ranges, is not taken
out of the points: it is part of their distances. ``user_data`` is 1 for the laser and 2 for the sonar,
``point_source_id`` the number of the pass plus 1.
"""

from datetime import date
from pathlib import Path

import laspy
import numpy as np
from laspy.header import GpsTimeType

import pipeline
from pipeline.atomic_files import flush_file, replacing
from pipeline.exports.cloud_file import points_file
from pipeline.exports.cloud_frame import CloudFrame
from pipeline.exports.cloud_points import CalibratedPoints, PlacedPoints
from pipeline.exports.explanation import REJECTED
from pipeline.exports.mounting import Origin
from pipeline.gps_time import ADJUSTED_STANDARD_OFFSET_S, NS

CLOUDS = {"las": "LAS 1.4 points", "laz": "LAZ points (LAS 1.4, compressed)"}
SCALE_M = 0.0001
SENSOR_NUMBERS = {"laser": 1, "mbes": 2}
_USER_ID, _FACES_RECORD = "poolcal", 1


def write_cloud(path: Path, points: CalibratedPoints, frame: CloudFrame, origin: Origin) -> int:
    """Write a LAS or LAZ file, whole or not at all, and return the number of points.

    Parameters
    ----------
    path
        The file; its suffix tells LAZ from LAS.
    points
        The points.
    frame
        The frame of the coordinates.
    origin
        Run and session; a rejected run is marked in the header.
    """
    header = _header(points, frame, origin)
    number = 0
    with replacing(path) as beside:
        with (
            points_file(beside) as stream,
            laspy.open(stream, mode="w", header=header, do_compress=path.suffix == ".laz", closefd=False) as file,
        ):
            for placed in points.batches():
                file.write_points(_records(placed, frame, header))
                number += len(placed.t_ns)
        flush_file(beside)
    return number


def _header(points: CalibratedPoints, frame: CloudFrame, origin: Origin) -> laspy.LasHeader:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.add_extra_dims(
        [
            laspy.ExtraBytesParams("residual_mm", np.float32, "from the surface, mm"),
            laspy.ExtraBytesParams("face", np.int16, "number of the face"),
        ]
    )
    header.scales, header.offsets = np.full(3, SCALE_M), frame.offset
    header.global_encoding.gps_time_type = GpsTimeType.STANDARD
    header.creation_date = date.fromisoformat(
        (origin.start_utc or "1980-01-06")[:10]
    )  # the same run gives the same bytes
    header.generating_software = f"poolcal {pipeline.__version__}"
    header.system_identifier = REJECTED if origin.rejected is not None else "poolcal export"
    if frame.crs is not None:
        header.add_crs(frame.crs)
    mark = [] if origin.rejected is None else [f"{REJECTED}: this run was rejected"]
    lines = [*mark, f"frame: {frame.name}", *(f"{number} {name}" for number, name in enumerate(points.face_names))]
    content = "\n".join(lines).encode("utf-8")
    header.vlrs.append(laspy.VLR(_USER_ID, _FACES_RECORD, "frame and faces", content))
    return header


def _records(placed: PlacedPoints, frame: CloudFrame, header: laspy.LasHeader) -> laspy.ScaleAwarePointRecord:
    records = laspy.ScaleAwarePointRecord.zeros(len(placed.t_ns), header=header)
    records.x, records.y, records.z = frame.coordinates(placed.points_target_m)
    t_ns = placed.t_ns - ADJUSTED_STANDARD_OFFSET_S * NS
    records.gps_time = t_ns // NS + t_ns % NS / NS
    records.return_number[:] = 1
    records.number_of_returns[:] = 1
    records.user_data[:] = SENSOR_NUMBERS[placed.sensor]
    records.point_source_id[:] = placed.number_of_pass + 1
    records["residual_mm"] = placed.residual_m * 1000.0
    records["face"] = placed.face
    return records
