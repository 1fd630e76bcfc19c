"""Reads an E57 file in a process of its own: ``python -P e57_worker.py FILE`` or ``FILE SCAN BATCH``.

A damaged file can crash libE57Format, or make it allocate as much memory as a damaged number claims. Only this process
ends then, and the process that started it reports the file. This module imports nothing of the project.

With FILE alone it writes a JSON text that describes the scans. With SCAN and BATCH it writes the points of that scan as
stored, in batches: seconds, the three coordinates, the marks of invalid points and of invalid times. A field that the
scan lacks is 0. :mod:`pipeline.readers.decoder_process` describes the bytes of both.
"""

import json
import sys
from typing import Any

import numpy as np
from pye57 import libe57

_MEMORY_BYTES = 1 << 30  # limit of this process; the buffers of a batch need a hundredth of it
DESCRIBING_S = 60  # limit of processor time for the description; a millisecond is usual
MAX_SCANS = 10_000
CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_ALL_CHECKSUMS = 100  # percent of checksums that are verified


def _scan_nodes(image: Any) -> list[Any]:
    data = libe57.VectorNode(image.root().get("data3D"))
    if data.childCount() > MAX_SCANS:
        raise ValueError(f"{data.childCount()} scans")
    return [libe57.StructureNode(data.get(k)) for k in range(data.childCount())]


def _number_at(node: Any, *path: str, default: float) -> float:
    """Return the number at a path of names below ``node``; ``default`` if there is none."""
    for name in path[:-1]:
        if not node.isDefined(name):
            return default
        node = libe57.StructureNode(node.get(name))
    if not node.isDefined(path[-1]):
        return default
    leaf = node.get(path[-1])
    kinds = {
        libe57.NodeType.E57_FLOAT: lambda: libe57.FloatNode(leaf).value(),
        libe57.NodeType.E57_INTEGER: lambda: libe57.IntegerNode(leaf).value(),
        libe57.NodeType.E57_SCALED_INTEGER: lambda: libe57.ScaledIntegerNode(leaf).scaledValue(),
    }
    return float(kinds[leaf.type()]())


def _points_and_fields(scan: Any) -> tuple[Any, dict[str, Any], tuple[str, ...]]:
    """Return a scan's points, their fields by name, and the names of the three coordinates."""
    points = libe57.CompressedVectorNode(scan.get("points"))
    prototype = libe57.StructureNode(points.prototype())
    fields = {prototype.get(k).elementName(): prototype.get(k) for k in range(prototype.childCount())}
    axes = next((axes for axes in (CARTESIAN, SPHERICAL) if set(axes) <= set(fields)), ())
    return points, fields, axes


def _is_single_precision(node: Any) -> bool:
    if node.type() != libe57.NodeType.E57_FLOAT:
        return False
    return bool(libe57.FloatNode(node).precision() == libe57.FloatPrecision.E57_SINGLE)


def _description(scan: Any) -> dict[str, Any]:
    points, fields, axes = _points_and_fields(scan)
    return {
        "points": points.childCount(),
        "timed": "timeStamp" in fields,
        "axes": "" if not axes else "cartesian" if axes is CARTESIAN else "spherical",
        "single": any(_is_single_precision(fields[axis]) for axis in axes),
        "start_s": _number_at(scan, "acquisitionStart", "dateTimeValue", default=0.0),
        "atomic": _number_at(scan, "acquisitionStart", "isAtomicClockReferenced", default=0.0) != 0,
        "rotation": [_number_at(scan, "pose", "rotation", axis, default=float(axis == "w")) for axis in "wxyz"],
        "translation": [_number_at(scan, "pose", "translation", axis, default=0.0) for axis in "xyz"],
    }


def _write_descriptions(path: str) -> None:
    image = libe57.ImageFile(path, "r", _ALL_CHECKSUMS)
    root = image.root()
    crs = libe57.StringNode(root.get("coordinateMetadata")).value() if root.isDefined("coordinateMetadata") else ""
    text = json.dumps({"crs": crs, "scans": [_description(scan) for scan in _scan_nodes(image)]}).encode()
    sys.stdout.buffer.write(np.int64(len(text)).tobytes() + text)


def _write_points(path: str, number: int, batch: int) -> None:
    image = libe57.ImageFile(path, "r", _ALL_CHECKSUMS)
    points, fields, axes = _points_and_fields(_scan_nodes(image)[number])
    invalid = "cartesianInvalidState" if axes is CARTESIAN else "sphericalInvalidState"
    columns = np.zeros((6, batch))
    buffers = libe57.VectorSourceDestBuffer()
    for row, field in enumerate(("timeStamp", *axes, invalid, "isTimeStampInvalid")):
        if field in fields:
            buffers.append(libe57.SourceDestBuffer(image, field, columns[row], batch, True, True))
    reader = points.reader(buffers)
    left = points.childCount()
    while left > 0 and (count := reader.read()):
        sys.stdout.buffer.write(np.int64(count).tobytes() + columns[:, :count].tobytes())
        left -= count
    sys.stdout.buffer.write(np.int64(0).tobytes())


def _main(path: str, *numbers: str) -> None:
    import resource

    resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY_BYTES, _MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if numbers:
        _write_points(path, *(int(number) for number in numbers))
    else:
        resource.setrlimit(resource.RLIMIT_CPU, (DESCRIBING_S, DESCRIBING_S))
        _write_descriptions(path)
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    try:
        _main(*sys.argv[1:])
    except Exception as error:  # the parent process turns it into a RawDataError
        words = str(error).partition("****")[0].strip()[:300]  # the library's source lines follow ****
        text = f"{type(error).__name__}: {words}".encode()
        sys.stdout.buffer.write(np.int64(-1).tobytes() + np.int64(len(text)).tobytes() + text)
        sys.stdout.buffer.flush()
