"""A sound file of every kind, to be damaged."""

import io
import tempfile
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from tests.support.files import build, e57_files, ie_files, sonar_files
from tests.support.files.las_files import laz_of

TIME = 1_400_000_000 * 10**9


def _laz() -> bytes:
    return laz_of(build.las([(k, k, k, 4e8 + k / 1000 + 0.0001) for k in range(40)]))


def _parquet() -> bytes:
    out = io.BytesIO()
    columns: dict[str, list[float]] = {"gps_ns": [TIME + k for k in range(40)]}
    columns |= {f"{axis}_m": [0.5] * 40 for axis in "xyz"}
    pq.write_table(pa.table(columns), out)
    return out.getvalue()


def _e57() -> bytes:
    columns = {f"cartesian{axis}": [0.1 * k for k in range(40)] for axis in "XYZ"}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.e57"
        e57_files.write(path, e57_files.Scan(columns | {"timeStamp": [0.01 * k for k in range(40)]}, 1.4e9))
        return path.read_bytes()


def _csv() -> bytes:
    return b"gps_ns,x_m,y_m,z_m\n" + b"".join(b"%d,1.5,2.5,-3.5\n" % (TIME + k) for k in range(40))


WHOLE: dict[str, tuple[str, str, bytes]] = {
    "bare": ("mbes", "r2sonic", b"".join(build.ping(k) for k in range(12))),
    "xtf": ("mbes", "r2sonic", build.xtf(*(build.ping(k) for k in range(6)))),
    "binary": ("ins", "novatel", b"".join(build.inspvas(9.0 + k) + build.inspvax(9.0 + k) for k in range(8))),
    "ascii": ("ins", "novatel", b"".join(build.inspvasa(9.0 + k) for k in range(12))),
    "sbet": ("ins", "sbet", build.sbet(*(9.0 + k for k in range(12)))),
    "ie": ("ins", "inertial_explorer", ie_files.whole("degrees", ie_files.truth(12))),
    "ie dms": ("ins", "inertial_explorer", ie_files.whole("sixtieths", ie_files.truth(12))),
    "ie utc": ("ins", "inertial_explorer", ie_files.whole("utc", ie_files.truth(12))),
    "ie commas": ("ins", "inertial_explorer", ie_files.whole("commas", ie_files.truth(12))),
    "las": ("laser", "las", build.las([(k, k, k, 4e8 + k / 1000 + 0.0001) for k in range(40)])),
    "csv": ("laser", "table", _csv()),
    "parquet": ("laser", "table", _parquet()),
    "laz": ("laser", "las", _laz()),
    "e57": ("laser", "e57", _e57()),
    "gsf": ("mbes", "gsf", sonar_files.gsf()),
    "kmall": ("mbes", "kmall", sonar_files.kmall()),
    "kmall sectors": ("mbes", "kmall", sonar_files.kmall_sectors()),
    "all": ("mbes", "all", sonar_files.kongsberg_all()),
}
