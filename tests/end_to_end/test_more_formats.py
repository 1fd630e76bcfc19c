"""The small session again, as E57 and .kmall, as GSF, and with the laser's points in UTM: the same calibration."""

from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest
from pyproj import CRS, Transformer

from pipeline.gps_time import NS, unix_ns_from_gps
from pipeline.simulation.scenario import load_scenario
from pipeline.simulation.session import SimulatedSession
from pipeline.simulation.session import simulate_session as simulate_in_memory
from tests.support.files import e57_files, sonar_files
from tests.support.places import Place, edit, result_of, simulate
from tests.support.same_result import run, same

STEPS = 500  # of a GSF angle in a degree: the fan's 65 degrees just fit
# Shares of a sigma. Coordinates that are rounded otherwise move single soundings over a limit of labelling; on the tops
# of this small session one of 170 moves roll by a quarter of its sigma.
LABELS_DIFFER = 0.4


def laser_as_e57(simulated: SimulatedSession, path: Path) -> None:
    laser = simulated.laser
    start_s = int(laser["t_ns"][0]) // NS - 7
    columns = {f"cartesian{axis.upper()}": laser[f"{axis}_m"] for axis in "xyz"}
    columns["timeStamp"] = (laser["t_ns"] - start_s * NS) / NS
    e57_files.write(path, e57_files.Scan(columns, float(start_s)))


def _pings(simulated: SimulatedSession) -> list[dict[str, Any]]:
    mbes = simulated.mbes
    starts = np.flatnonzero(np.diff(mbes["ping"], prepend=-1))
    return [
        {name: values[one:other] for name, values in mbes.items()}
        for one, other in zip(starts, [*starts[1:], len(mbes["ping"])], strict=True)
    ]


def soundings_as_kmall(simulated: SimulatedSession, path: Path) -> None:
    datagrams = []
    for ping in _pings(simulated):
        port = -np.degrees(ping["angle_rad"])
        fan = [sonar_files.sounding(k, *one) for k, one in enumerate(zip(port, ping["two_way_time_s"], strict=True))]
        seconds, nanoseconds = divmod(int(unix_ns_from_gps(ping["t_ns"])[0]), NS)
        speed = float(ping["sound_speed_m_s"][0])
        when = {"seconds": seconds, "nanoseconds": nanoseconds}
        datagrams.append(sonar_files.mrz(int(ping["ping"][0]) % 2**16, fan, speed_m_s=speed, **when))
    path.write_bytes(b"".join(datagrams))


def soundings_as_gsf(simulated: SimulatedSession, path: Path) -> None:
    factors = sonar_files.scale_factors(time=(10**9, 0), angle=(STEPS, 0))
    records = [sonar_files.gsf_header()]
    for k, ping in enumerate(_pings(simulated)):
        records.append(
            sonar_files.gsf_ping(
                times=np.rint(ping["two_way_time_s"] * 1e9).astype(int).tolist(),
                angles=np.rint(-np.degrees(ping["angle_rad"]) * STEPS).astype(int).tolist(),
                extra=(factors if not k else b"") + sonar_files.seabat(float(ping["sound_speed_m_s"][0])),
                unix_ns=int(unix_ns_from_gps(ping["t_ns"])[0]),
                beams=len(ping["ping"]),
                wide=True,
            )
        )
    path.write_bytes(b"".join(records))


@pytest.mark.parametrize("sonar", ["gsf", pytest.param("kmall", marks=pytest.mark.thorough)])
def test_e57_and_a_sonar_s_files(sonar: str, small: Path, tmp_path: Path, undisturbed: tuple[Path, Any]) -> None:
    simulated = simulate_in_memory(load_scenario(small.with_name("session.scenario.yaml")), 1)
    place = Place(small, tmp_path)
    place.mend()
    laser_as_e57(simulated, place.session / "laser" / "a.e57")
    write = {"kmall": soundings_as_kmall, "gsf": soundings_as_gsf}[sonar]
    write(simulated, place.session / "mbes" / f"a.{sonar}")
    place.edit_session("laser", format="e57", files=["laser/*.e57"])
    place.edit_session("mbes", format=sonar, files=[f"mbes/*.{sonar}"])
    same(result_of(undisturbed[0]), run(place.session), LABELS_DIFFER)


@pytest.mark.parametrize(
    ("geocentric", "projected"),
    [("EPSG:4978", "EPSG:32651"), pytest.param("EPSG:4479", "EPSG:4549", marks=pytest.mark.thorough)],
)
def test_laser_points_on_a_map(
    geocentric: str, projected: str, tmp_path: Path, undisturbed: tuple[Path, Any]
) -> None:
    """LAS in ECEF as the simulator writes it; the same points in UTM, or in China's Gauss-Krueger zone when the INS
    is in CGCS2000, with ellipsoidal heights."""
    session = simulate(tmp_path / "session", laser={"frame": "EPSG:4978"})
    to_utm = Transformer.from_crs(geocentric, CRS(projected).to_3d(), always_xy=True)
    for path in sorted((session / "laser").glob("*.las")):
        points = laspy.read(path)
        east, north, up = to_utm.transform(points.x, points.y, points.z)
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.scales, header.offsets = np.full(3, 1e-4), np.floor([east[0], north[0], up[0]])
        header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
        header.add_crs(CRS(projected))
        moved = laspy.LasData(header)
        moved.x, moved.y, moved.z, moved.gps_time = east, north, up, points.gps_time
        moved.write(str(path))
    edit(session / "session.yaml", "laser", frame=projected, heights="ellipsoidal")
    same(result_of(undisturbed[0]), run(session), LABELS_DIFFER)
