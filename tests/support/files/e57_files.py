"""E57 files with times, by the writer of pye57's libE57Format."""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pye57 import libe57

START_S = 1_398_556_818.25  # GPS seconds: 2024-05-01
POINTS = {"cartesianX": (1.0, 2.0, 3.0), "cartesianY": (4.0, 5.0, 6.0), "cartesianZ": (7.0, 8.0, 9.5)}
TIMES = {"timeStamp": (0.0, 0.500001, 10.0)}
ALWAYS = {"cartesianInvalidState": 2, "sphericalInvalidState": 2, "isTimeStampInvalid": 1}  # flags, and their most


@dataclass(frozen=True)
class Scan:
    """Columns by E57's names; ``single``: those stored as float32."""

    columns: Mapping[str, Sequence[float]]
    start_s: float | None = None
    atomic: int = 1
    rotation: tuple[float, float, float, float] | None = None  # w, x, y, z
    translation: tuple[float, float, float] | None = None
    single: frozenset[str] = field(default_factory=frozenset)


def write(path: Path, *scans: Scan, crs: str = "") -> None:
    image = libe57.ImageFile(str(path), "w")
    image.extensionsAdd("", libe57.E57_V1_0_URI)
    root = image.root()
    for name, text in (("formatName", "ASTM E57 3D Imaging Data File"), ("guid", "{0}"), ("coordinateMetadata", crs)):
        root.set(name, libe57.StringNode(image, text))
    for name, number in (("versionMajor", 1), ("versionMinor", 0)):
        root.set(name, libe57.IntegerNode(image, number))
    data = libe57.VectorNode(image, True)
    root.set("data3D", data)
    for scan in scans:
        _add(image, data, scan)
    image.close()


def edited(content: bytes, old: bytes, new: bytes) -> bytes:
    """A file with something of its XML replaced, its lengths and the checksums of its pages right."""
    inside = b"".join(content[k : k + 1020] for k in range(0, len(content), 1024))
    (length,) = struct.unpack_from("<Q", inside, 32)
    inside = inside.replace(old, new)
    inside = inside[:32] + struct.pack("<Q", length + len(new) - len(old)) + inside[40:]
    inside = inside.ljust(len(content) // 1024 * 1020, b"\0")
    inside += bytes(-len(inside) % 1020)
    size = len(inside) // 1020 * 1024
    inside = inside[:16] + struct.pack("<Q", size) + inside[24:]
    pages = (inside[k : k + 1020] for k in range(0, len(inside), 1020))
    return b"".join(page + struct.pack(">I", _crc32c(page)) for page in pages)


def _crc32c(data: bytes) -> int:
    value = 0xFFFFFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = (value >> 1) ^ (0x82F63B78 if value & 1 else 0)
    return value ^ 0xFFFFFFFF


def _add(image: libe57.ImageFile, data: libe57.VectorNode, scan: Scan) -> None:
    node = libe57.StructureNode(image)
    data.append(node)
    node.set("guid", libe57.StringNode(image, "{1}"))
    if scan.start_s is not None:
        start = libe57.StructureNode(image)
        node.set("acquisitionStart", start)
        start.set("dateTimeValue", libe57.FloatNode(image, scan.start_s))
        start.set("isAtomicClockReferenced", libe57.IntegerNode(image, scan.atomic))
    if scan.rotation is not None or scan.translation is not None:
        pose = libe57.StructureNode(image)
        node.set("pose", pose)
        parts: tuple[tuple[str, str, Sequence[float] | None], ...]
        parts = (("rotation", "wxyz", scan.rotation), ("translation", "xyz", scan.translation))
        for name, axes, numbers in parts:
            if numbers is not None:
                part = libe57.StructureNode(image)
                pose.set(name, part)
                for axis, value in reversed(list(zip(axes, numbers, strict=True))):  # by name, in whatever order
                    part.set(axis, libe57.FloatNode(image, value))
    prototype = libe57.StructureNode(image)
    buffers = libe57.VectorSourceDestBuffer()
    kept = []
    for name, values in scan.columns.items():
        if name in ALWAYS:
            prototype.set(name, libe57.IntegerNode(image, 0, 0, ALWAYS[name]))
        else:
            precision = libe57.FloatPrecision.E57_SINGLE if name in scan.single else libe57.FloatPrecision.E57_DOUBLE
            limit = 3e38 if name in scan.single else 1e300
            prototype.set(name, libe57.FloatNode(image, 0.0, precision, -limit, limit))
        column = np.array(values, dtype=np.int8 if name in ALWAYS else np.float64)
        kept.append(column)
        buffers.append(libe57.SourceDestBuffer(image, name, column, len(column), True, True))
    points = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
    node.set("points", points)
    writer = points.writer(buffers)
    writer.write(len(kept[0]))
    writer.close()
