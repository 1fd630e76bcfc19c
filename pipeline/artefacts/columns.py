"""Types of columns, and the columns that several tables share."""

# fmt: off: the tables are laid out by hand
import pyarrow as pa

from pipeline.artefacts.schema import Column

I16, I32, I64, F32, F64, TEXT, BOOL = (
    pa.int16(), pa.int32(), pa.int64(), pa.float32(), pa.float64(), pa.string(), pa.bool_()
)
FLOATS = pa.list_(pa.float64())


def coordinate_columns(frame: str, unit: str = "m", stem: str = "", type_: pa.DataType = F64) -> tuple[Column, ...]:
    """Return the columns of x, y, z.

    Parameters
    ----------
    frame : str
        Frame of the coordinates.
    unit : str
        Unit of the coordinates.
    stem : str
        First part of the columns' names.
    type_ : DataType
        Type of the columns.
    """
    return tuple(Column(f"{stem}{axis}_{frame}_{unit}", type_, unit, f"{axis} in frame {frame}") for axis in "xyz")


def float32_coordinates(frame: str) -> tuple[Column, ...]:
    """Return the columns of x, y, z in single precision. Within 16 m its rounding error is at most 0.5 µm."""
    return coordinate_columns(frame, type_=F32)


ROTATION = tuple(
    Column(f"rotation_{axis}_deg", F64, "deg", f"rotation vector from the coarse mount, body {axis}") for axis in "xyz"
)
MOUNT_CORRECTION = (
    *ROTATION, *(Column(f"lever_arm_{axis}_m", F64, "m", f"lever arm correction, body {axis}") for axis in "xyz")
)
ALL_PASSES = -1  # number of the pass in rows for all passes together
T_NS = Column("t_ns", I64, "ns", "GPS time: nanoseconds since 1980-01-06 00:00:00 GPS, latency removed")
PASS = Column("pass", I16, "1", "number of the pass, from 0; -1: none (or all of them together)")
COUNTS = (
    Column("source", TEXT, "", "stream the points came from"),
    Column("reason", TEXT, "", "why they were left out; 'used' counts what went on"),
    Column("code", TEXT, "", "the reason for programs: stays when its words change"),
    Column("count", I64, "1", "number of points"),
)

