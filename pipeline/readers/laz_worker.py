"""Unpacks points of a LAZ file in a process of its own.

    python -P laz_worker.py FILE START STOP BATCH SIZE POINTS RECORD LENGTH

A damaged file can crash lazrs 0.8 (segmentation fault, failed allocation, panic) without an exception. Only this
process ends then, and the process that started it reports the file. This module imports nothing of the project, and
neither numpy nor laspy: their imports would take as long as a million points. A point has SIZE bytes. POINTS is the
byte at which the points begin, RECORD that of the LASzip record of LENGTH bytes.

It writes batches in the form that :mod:`pipeline.readers.decoder_process` describes: points as in an uncompressed file.
In formats 6 to 10 only places, returns and GPS times are unpacked; the other fields mean nothing.
"""

import struct
import sys

_MEMORY_BYTES = 1 << 30  # limit of this process; a batch and its chunks need a twentieth of it


def _main(path: str, start: int, stop: int, batch: int, size: int, points: int, record: int, length: int) -> None:
    import resource

    import lazrs

    resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY_BYTES, _MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    wanted = lazrs.SELECTIVE_DECOMPRESS_XY_RETURNS_CHANNEL
    wanted |= lazrs.SELECTIVE_DECOMPRESS_Z | lazrs.SELECTIVE_DECOMPRESS_GPS_TIME
    out = sys.stdout.buffer
    with open(path, "rb") as file:
        file.seek(record)
        laszip = file.read(length)
        if size != lazrs.LazVlr(laszip).item_size():
            raise ValueError("the LASzip record describes points of another size than the header")
        file.seek(points)
        decompressor = lazrs.LasZipDecompressor(file, laszip, lazrs.DecompressionSelection(wanted))
        if start:
            decompressor.seek(start)
        memory = memoryview(bytearray(min(batch, stop - start) * size))  # taken once: new memory takes time to clear
        while start < stop:
            count = min(batch, stop - start)
            unpacked = memory[: count * size]
            decompressor.decompress_many(unpacked)
            out.write(struct.pack("=q", count))
            out.write(unpacked)
            start += count
    out.write(struct.pack("=q", 0))
    out.flush()


if __name__ == "__main__":
    try:
        _main(sys.argv[1], *(int(word) for word in sys.argv[2:]))
    except Exception as error:  # the parent process turns it into a RawDataError
        text = f"{type(error).__name__}: {error}".encode()
        sys.stdout.buffer.write(struct.pack("=qq", -1, len(text)) + text)
        sys.stdout.buffer.flush()
