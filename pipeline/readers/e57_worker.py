"""Reads an E57 file in a process of its own: ``python -P e57_worker.py FILE`` or ``FILE SCAN BATCH``.

libE57Format can die of a damaged file, or allocate what a damaged number claims. Here only this process dies, and
:mod:`pipeline.readers.e57` says which file it was. It imports nothing of the project.

FILE alone: a text, JSON, of what the scans are. With SCAN: its points as stored, batch by batch: seconds, the three
coordinates, and whether point and time are marked as invalid; what the scan has not is 0. Both are written as
:mod:`pipeline.readers.decoder_process` says.
"""

import json
import sys
from typing import Any

import numpy as np
from pye57 import libe57

MEMORY_BYTES = 1 << 30  # written to; the buffers of a batch need a hundredth
DESCRIBING_S = 60  # of computing; a millisecond is usual
MAX_SCANS = 10_000
CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
ALL = 100  # percent of checksums that are looked at


def scans_of(image: Any) -> list[Any]:
    data = libe57.VectorNode(image.root().get("data3D"))
    if data.childCount() > MAX_SCANS:
        raise ValueError(f"{data.childCount()} scans")
    return [libe57.StructureNode(data.get(k)) for k in range(data.childCount())]


def value(node: Any, *path: str, default: float) -> float:
    """The number at a path of names below ``node``; ``default`` where there is none."""
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


def points_of(scan: Any) -> tuple[Any, dict[str, Any], tuple[str, ...]]:
    """A scan's points, their fields, and the three of the coordinates."""
    points = libe57.CompressedVectorNode(scan.get("points"))
    prototype = libe57.StructureNode(points.prototype())
    fields = {prototype.get(k).elementName(): prototype.get(k) for k in range(prototype.childCount())}
    axes = next((axes for axes in (CARTESIAN, SPHERICAL) if set(axes) <= set(fields)), ())
    return points, fields, axes


def is_single(node: Any) -> bool:
    if node.type() != libe57.NodeType.E57_FLOAT:
        return False
    return bool(libe57.FloatNode(node).precision() == libe57.FloatPrecision.E57_SINGLE)


def described(scan: Any) -> dict[str, Any]:
    points, fields, axes = points_of(scan)
    return {
        "points": points.childCount(),
        "timed": "timeStamp" in fields,
        "axes": "" if not axes else "cartesian" if axes is CARTESIAN else "spherical",
        "single": any(is_single(fields[axis]) for axis in axes),
        "start_s": value(scan, "acquisitionStart", "dateTimeValue", default=0.0),
        "atomic": value(scan, "acquisitionStart", "isAtomicClockReferenced", default=0.0) != 0,
        "rotation": [value(scan, "pose", "rotation", axis, default=float(axis == "w")) for axis in "wxyz"],
        "translation": [value(scan, "pose", "translation", axis, default=0.0) for axis in "xyz"],
    }


def describe(path: str) -> None:
    image = libe57.ImageFile(path, "r", ALL)
    root = image.root()
    told = libe57.StringNode(root.get("coordinateMetadata")).value() if root.isDefined("coordinateMetadata") else ""
    text = json.dumps({"crs": told, "scans": [described(scan) for scan in scans_of(image)]}).encode()
    sys.stdout.buffer.write(np.int64(len(text)).tobytes() + text)


def unpack(path: str, number: int, batch: int) -> None:
    image = libe57.ImageFile(path, "r", ALL)
    points, fields, axes = points_of(scans_of(image)[number])
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


def main(path: str, *numbers: str) -> None:
    import resource

    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if numbers:
        unpack(path, *(int(number) for number in numbers))
    else:
        resource.setrlimit(resource.RLIMIT_CPU, (DESCRIBING_S, DESCRIBING_S))
        describe(path)
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except Exception as error:  # the parent makes one RawDataError of it
        words = str(error).partition("****")[0].strip()[:300]  # the library's own sources and lines follow
        told = f"{type(error).__name__}: {words}".encode()
        sys.stdout.buffer.write(np.int64(-1).tobytes() + np.int64(len(told)).tobytes() + told)
        sys.stdout.buffer.flush()
