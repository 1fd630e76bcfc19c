"""Limit of the number of records that a file may claim to hold.

In a compressed file a few bytes can stand for any number of equal points. Without a limit a file of 2 MB keeps the
program busy for hours, and fills the disk. Real points and records differ from each other, and each takes at least one
byte, even if compressed. Points on a perfect grid take a tenth of a byte each.
"""

from pipeline.errors import RawDataError

RECORDS_PER_BYTE = 16


def refuse_claim(claimed: int, size: int, most: int | None, sensor: str, name: str) -> None:
    """Refuse a file that claims more records than it can hold.

    Parameters
    ----------
    claimed : int
        Number of records that the file claims to hold.
    size : int
        Size of the file, bytes.
    most : int or None
        ``max_records`` of session.yaml; None: the limit is RECORDS_PER_BYTE records per byte.
    sensor : str
        ins, laser or mbes, for the message.
    name : str
        The file's path in the session folder, for the message.

    Raises
    ------
    RawDataError
        The file claims more records than the limit, or a negative number.
    """
    if 0 <= claimed <= (RECORDS_PER_BYTE * size if most is None else most):
        return
    limit = f"more than {RECORDS_PER_BYTE} a byte" if most is None else f"{sensor}.max_records is {most}"
    raise RawDataError(
        f"{name}: claims {claimed} records in {size} bytes, {limit}: it is damaged, or not what it seems; export it "
        f"again, or, if it really holds so many, write {sensor}.max_records: {max(claimed, 0)} in session.yaml"
    )
