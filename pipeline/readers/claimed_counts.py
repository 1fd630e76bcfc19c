"""How many records a file may claim to hold: a few bytes can stand for any number of points that are all the same.

Without a bound a file of 2 MB keeps the program busy for hours, and fills the disk. Real points and records differ from
each other, and take a byte each at least, however they are packed; points on a perfect grid go ten to a byte.
"""

from pipeline.errors import RawDataError

RECORDS_PER_BYTE = 16


def refuse_claim(claimed: int, size: int, most: int | None, sensor: str, name: str) -> None:
    """Refuse a file of ``size`` bytes that claims more than ``most`` (None: as many as its size makes likely).

    Raises
    ------
    RawDataError
        It does.
    """
    if 0 <= claimed <= (RECORDS_PER_BYTE * size if most is None else most):
        return
    limit = f"more than {RECORDS_PER_BYTE} a byte" if most is None else f"{sensor}.max_records is {most}"
    raise RawDataError(
        f"{name}: claims {claimed} records in {size} bytes, {limit}: it is damaged, or not what it seems; export it "
        f"again, or, if it really holds so many, write {sensor}.max_records: {max(claimed, 0)} in session.yaml"
    )
