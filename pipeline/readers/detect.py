"""What a file is, by its content; advice for those that cannot be read."""

import re
from pathlib import Path

import numpy as np

from pipeline.errors import RawDataError

HEAD = 65_536
SBET_RECORD, ACCURACY_RECORD = 136, 80  # bytes

ADVICE = {
    "RIEGL RXP": "is a RIEGL .rxp, which only RIEGL's own library reads; export it to LAS or LAZ with GPS time stamps",
    "RIEGL RDBX": "is a RIEGL .rdbx, which only RIEGL's own library reads; export it to LAS or LAZ with GPS time stamps",
    "E57": "is an E57 file; export it to LAS or LAZ with GPS time stamps",
    "PCD": "is a PCD file; export it to LAS or LAZ with GPS time stamps",
    "GSF": "is a GSF file; give the sonar's own R2Sonic packets (in XTF or .r2s), or a table",
    "KMALL": "is a Kongsberg .kmall; give R2Sonic packets (in XTF or .r2s), or a table",
    "SBET accuracy": "holds the accuracies (SMRMSG) of an SBET, not the trajectory; give the SBET itself",
    "empty": "is empty; copy it again from the instrument",
    "text": "is text of an unknown layout; see README.md for the tables that are read",
    "unknown": "is of no kind that is read; see README.md for the formats",
}


def kind_of(path: Path) -> str:
    """novatel, sbet, xtf, r2sonic, las, parquet, csv, or one of the kinds in :data:`ADVICE`."""
    try:
        if not path.is_file():
            raise RawDataError(f"{path}: is not a file; check the files of session.yaml")
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError as error:
        raise RawDataError(f"{path}: cannot be read ({error.strerror}); check its permissions") from error
    if not head:
        return "empty"
    for test, kind in (
        (head[:4] == b"LASF", "las"),
        (head[:4] == b"PAR1", "parquet"),
        (head[:8] == b"ASTM-E57", "E57"),
        (b"RieglLMS" in head[:256], "RIEGL RXP"),
        (b"RDB" in head[:64] and b"RIEGL" in head[:256].upper(), "RIEGL RDBX"),
        (re.match(rb"(# \.PCD|VERSION )", head) is not None and b"\nFIELDS " in head[:1024], "PCD"),
        (b"GSF-v" in head[:64], "GSF"),
        (re.match(rb"....#[A-Z]{3}", head, re.DOTALL) is not None, "KMALL"),
        (re.match(rb"(.{4})?BTH0.{8}[A-Z][0-9]", head, re.DOTALL) is not None, "r2sonic"),
    ):
        if test:
            return kind
    return _by_structure(head, size)


def _by_structure(head: bytes, size: int) -> str:
    if head[0] == 0x7B and b"\xce\xfa" in head[:2048]:
        return "xtf"
    if re.search(rb"\xaa\x44[\x12\x13]", head[:8192]) or re.search(
        rb"(^|\n)[#%](INSPVA|INSPVAS|INSPVAX|[A-Z0-9]{4,14})A?,", head[:8192]
    ):
        return "novatel"
    if _is_trajectory(head):
        return "SBET accuracy" if _times_fit(head, ACCURACY_RECORD) and not _times_fit(head, SBET_RECORD) else "sbet"
    if re.search(rb"BTH0.{8}[A-Z][0-9]", head, re.DOTALL):
        return "r2sonic"
    try:
        text = head.decode("utf-8", errors="strict" if size <= HEAD else "ignore")
    except UnicodeDecodeError:
        return "unknown"
    if "\0" in text:
        return "unknown"
    first = text.lstrip("\ufeff").splitlines()[0] if text.strip() else ""
    return "csv" if "," in first and re.match(r"\s*[A-Za-z_]", first) else "text"


def _is_trajectory(head: bytes) -> bool:
    """A first record whose time of week, latitude, longitude and height are possible (accuracies pass as well)."""
    if len(head) < ACCURACY_RECORD:
        return False
    time, latitude, longitude, height = np.frombuffer(head[:32], "<f8").tolist()
    numbers = np.frombuffer(head[:ACCURACY_RECORD], "<f8")
    return bool(
        np.all(np.isfinite(numbers))
        and np.all(np.abs(numbers) < 1e7)
        and 1e-3 < time < 700_000
        and 1e-9 < abs(latitude) <= np.pi / 2 + 10
        and abs(longitude) <= 2 * np.pi + 10
        and abs(height) < 20_000
    )


def _times_fit(head: bytes, record: int) -> bool:
    """Whether records of this length begin with times that ascend by less than a minute each."""
    numbers = min(len(head) // record, 50)
    times = np.array([np.frombuffer(head, "<f8", 1, k * record)[0] for k in range(numbers)])
    steps = np.diff(times)
    return numbers > 1 and bool(np.all(np.isfinite(steps)) and np.all(steps > 0) and np.all(steps < 60))


def refuse(path: Path, kind: str, wanted: str) -> RawDataError:
    """The error for a file that is not what ``format`` says."""
    known = {"novatel": "NovAtel log", "sbet": "SBET", "xtf": "XTF", "r2sonic": "R2Sonic packets", "las": "LAS/LAZ"}
    if kind in ADVICE:
        return RawDataError(f"{path}: {ADVICE[kind]}")
    what = {"csv": "a table (CSV)", "parquet": "a table (Parquet)"}.get(kind, f"a file of format {known.get(kind, kind)}")
    return RawDataError(f"{path}: is {what}, but session.yaml says format: {wanted}; mend format, or the files' list")
