"""Points for LAS files, and LAZ of a LAS file."""

import io

import laspy

ADJUSTED = 400_000_000.0  # 2024-05


def las_points(
    count: int, first_s: float = ADJUSTED + 0.001, step_s: float = 0.001
) -> list[tuple[int, int, int, float]]:
    """x, y, z as stored, and the time."""
    return [(k, -2 * k, 1000 + k, first_s + k * step_s) for k in range(count)]


def laz_of(content: bytes) -> bytes:
    points = laspy.read(io.BytesIO(content))
    out = io.BytesIO()
    points.write(out, do_compress=True)
    return out.getvalue()
