"""Unpacks points of a LAZ file in a process of its own: ``python -P laz_worker.py FILE START STOP BATCH``.

A damaged file can crash lazrs 0.8 (segmentation fault, failed allocation, panic) without an exception. Only this
process ends then, and the process that started it reports the file. This module imports nothing of the project.

It writes batches in the form that :mod:`pipeline.readers.decoder_process` describes: GPS time, x, y, z.
"""

import sys

import numpy as np

_MEMORY_BYTES = 1 << 30  # limit of this process; a batch and its chunks need a twentieth of it


def _main(path: str, start: int, stop: int, batch: int) -> None:
    import resource

    import laspy

    resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY_BYTES, _MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    wanted = laspy.DecompressionSelection
    selection = wanted.base() | wanted.XY_RETURNS_CHANNEL | wanted.Z | wanted.GPS_TIME
    out = sys.stdout.buffer
    with laspy.open(path, read_evlrs=False, decompression_selection=selection) as reader:
        if start:
            reader.seek(start)
        while start < stop:
            points = reader.read_points(min(batch, stop - start))
            if not len(points):
                break
            out.write(np.int64(len(points)).tobytes())
            timed = "gps_time" in points.point_format.dimension_names
            for values in (points.gps_time if timed else np.zeros(len(points)), points.x, points.y, points.z):
                out.write(np.ascontiguousarray(values, dtype=np.float64).tobytes())
            start += len(points)
    out.write(np.int64(0).tobytes())
    out.flush()


if __name__ == "__main__":
    try:
        _main(sys.argv[1], *(int(word) for word in sys.argv[2:]))
    except Exception as error:  # the parent process turns it into a RawDataError
        text = f"{type(error).__name__}: {error}".encode()
        sys.stdout.buffer.write(np.int64(-1).tobytes() + np.int64(len(text)).tobytes() + text)
        sys.stdout.buffer.flush()
