"""A model of a survey software: it georeferences a session with the mount that was entered, and exports soundings.

It is independent of the program: the raw files are read with the program's readers, but rotations are scipy's, geodesy
is PROJ's, and angles are typed into axes forward, starboard, down (roll + starboard down, pitch + bow up, heading
clockwise), turned in the order heading · pitch · roll or in another.

    python -m tools.survey_software SESSION RUN OUT.xyz [--roll-sign -1] [--order rph] [--crs EPSG:32651] ...

OUT's ending chooses the form: .xyz, .csv, .las, .laz.
"""

import argparse
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from pipeline.config.load import load_session
from pipeline.readers.casts import with_cast
from pipeline.readers.dispatch import raw_parts

Array = NDArray[np.float64]
FRD = np.array(
    [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]
)  # starboard, forward, up -> forward, starboard, down
SPEED_M_S = 1480.0
LETTERS = {"h": "Z", "p": "Y", "r": "X"}  # axes of the angles in forward, starboard, down


@dataclass(frozen=True)
class Entry:
    """What was typed into the software, and how it works.

    Attributes
    ----------
    angles_deg
        Roll, pitch, heading of the mount.
    lever_arm_m
        Forward, starboard, down.
    order
        Order of the matrices, from left to right.
    delay_s
        The poses that it uses are later than the soundings by this.
    level_lever_arm
        Whether it turns the lever arm by the heading alone.
    range_factor
        Its ranges by the recorded ones.
    matrix
        Rotation R_body_from_mbes (3, 3) in place of the angles, axes starboard, forward, up.
    steer_factor
        Sines of its beam angles by the recorded ones.
    gradient_per_s
        Growth of its sound speed with depth: rays bend toward the lower speed.
    shift_m
        East, north, up: of all positions.
    attitude_deg
        Added to all roll, pitch, heading: another alignment of the INS.
    wander_m
        Size of the slow differences of its trajectory, with periods of 40 to 300 s.
    smoothed_beams
        Each sounding is the mean of so many neighbours.
    """

    angles_deg: tuple[float, float, float]
    lever_arm_m: tuple[float, float, float]
    order: str = "hpr"
    delay_s: float = 0.0
    level_lever_arm: bool = False
    range_factor: float = 1.0
    matrix: Array | None = None
    steer_factor: float = 1.0
    gradient_per_s: float = 0.0
    shift_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    attitude_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    wander_m: float = 0.0
    smoothed_beams: int = 1

    def rotation(self) -> Array:
        """Return the mount's rotation, forward-starboard-down from the sonar's forward-starboard-down axes."""
        if self.matrix is not None:
            return np.asarray(FRD @ self.matrix @ FRD)
        by_letter = dict(zip("rph", self.angles_deg, strict=True))
        axes = "".join(LETTERS[letter] for letter in self.order)
        angles = [by_letter[letter] for letter in self.order]
        return np.asarray(Rotation.from_euler(axes, angles, degrees=True).as_matrix())  # capitals: turned axes


@dataclass(frozen=True)
class Recording:
    """A session's raw data: soundings in forward, starboard, down; the INS's records."""

    t_ns: NDArray[np.int64]
    points_m: Array
    ins: dict[str, NDArray[Any]]


def entry_of(result: dict[str, Any]) -> Entry:
    """Return the right entry, from the content of calibration.json."""
    mount = result["mbes"]["mount"]
    return Entry(
        (mount["roll_deg"], mount["pitch_deg"], -mount["yaw_deg"]), (mount["y_m"], mount["x_m"], -mount["z_m"])
    )


def recording(session: Path) -> Recording:
    """Return a session's raw data; the sound speed is the recorded one."""
    config = load_session(session, with_cast)
    ins = [chunk.columns for part in raw_parts("ins", config.ins, session) for chunk in part.chunks()]
    mbes = [chunk.columns for part in raw_parts("mbes", config.sonar, session) for chunk in part.chunks()]
    poses = {name: np.concatenate([columns[name] for columns in ins]) for name in ins[0]}
    order = np.argsort(poses["t_ns"], kind="stable")
    both = {name: np.concatenate([columns[name] for columns in mbes]) for name in mbes[0]}
    ranges = both["two_way_time_s"] * both["sound_speed_m_s"] / 2
    across, along = np.sin(both["angle_rad"]), np.sin(both["transmit_tilt_rad"])
    down = np.sqrt(1 - across**2 - along**2) * np.where(np.abs(both["angle_rad"]) > np.pi / 2, -1, 1)
    return Recording(
        both["t_ns"], np.stack([along, across, down], 1) * ranges[:, None], {k: v[order] for k, v in poses.items()}
    )


def georeferenced(recorded: Recording, entry: Entry) -> Array:
    """Return the soundings (n, 3) m in ECEF, as the software places them."""
    from pyproj import Transformer

    ins, t = recorded.ins, recorded.ins["t_ns"]
    latitude, longitude = np.degrees(ins["latitude_rad"]), np.degrees(ins["longitude_rad"])
    to_ecef = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    track = np.stack(to_ecef.transform(longitude, latitude, ins["height_m"]), 1)
    level = Rotation.from_euler("ZY", np.stack([longitude, -90.0 - latitude], 1), degrees=True)  # ecef from n, e, d
    headings = np.stack([ins["azimuth_rad"], ins["pitch_rad"], ins["roll_rad"]], 1)
    headings += np.radians(entry.attitude_deg[::-1])
    at = np.clip(recorded.t_ns + round(entry.delay_s * 1e9), t[0], t[-1])
    seconds = (t - t[0]) / 1e9
    poses = Slerp(seconds, level * Rotation.from_euler("ZYX", headings))((at - t[0]) / 1e9)
    place = np.stack([np.interp((at - t[0]) / 1e9, seconds, axis) for axis in track.T], 1)
    seen = poses.apply(_pointed(recorded.points_m, entry) @ entry.rotation().T)
    arm = np.array(entry.lever_arm_m)
    if entry.level_lever_arm:
        heading_only = np.zeros_like(headings)
        heading_only[:, 0] = headings[:, 0]
        flat = Slerp(seconds, level * Rotation.from_euler("ZYX", heading_only))((at - t[0]) / 1e9)
        down = flat.inv().apply(poses.apply(arm))[:, 2]
        moved = flat.apply(np.column_stack([np.tile(arm[:2], (len(at), 1)), down]))
    else:
        moved = poses.apply(arm)
    up = place / np.linalg.norm(place, axis=1)[:, None]  # of the sphere: the ellipsoid's is 0.2 degrees off at most
    height = np.einsum("ni,ni->n", seen, up)[:, None]
    level_range = np.linalg.norm(seen - height * up, axis=1)[:, None]
    bent = up * entry.gradient_per_s / SPEED_M_S * level_range**2 / 2  # an arc of the curvature gradient / speed
    shift = level.apply(np.array([entry.shift_m[1], entry.shift_m[0], -entry.shift_m[2]]))[0]
    placed = place + moved + seen + bent + shift + _wander((at - t[0]) / 1e9, entry.wander_m)
    return _smoothed(np.asarray(placed), recorded.t_ns, entry.smoothed_beams)


def _pointed(points_m: Array, entry: Entry) -> Array:
    """Return the soundings with the software's beam angles and ranges; x and y are those of an array's two cones."""
    level = points_m[:, :2] * entry.steer_factor
    ranges = np.linalg.norm(points_m, axis=1)
    down = np.sqrt(np.maximum(ranges**2 - (level**2).sum(axis=1), 0.0)) * np.sign(points_m[:, 2])
    return np.column_stack([level, down]) * entry.range_factor


def _wander(at_s: Array, size_m: float) -> Array:
    """Return slow differences (n, 3) of a trajectory, a sum of waves; the same at each call."""
    random = np.random.default_rng(11)
    waves = [np.sin(2 * np.pi * (at_s[:, None] / random.uniform(40, 300, 3) + random.random(3))) for _ in range(4)]
    return np.asarray(size_m * sum(waves) / np.sqrt(2))


def _smoothed(points: Array, t_ns: NDArray[np.int64], beams: int) -> Array:
    """Return means of so many neighbours in a ping; those at the ends stay as they are."""
    if beams == 1:
        return points
    means = np.stack([np.convolve(axis, np.full(beams, 1 / beams), "same") for axis in points.T], 1)
    half = beams // 2
    whole = np.zeros(len(points), bool)
    whole[half:-half] = t_ns[2 * half :] == t_ns[: -2 * half]
    return np.where(whole[:, None], means, points)


def in_crs(ecef_m: Array, crs: str, lift_m: float = 0.0) -> Array:
    """Return points (n, 3) in a CRS: east or longitude, north or latitude, ellipsoidal height plus ``lift_m``."""
    from pyproj import CRS, Transformer

    target = CRS.from_user_input(crs)
    if target.is_geocentric:
        return ecef_m
    x, y, z = ecef_m.T
    places = Transformer.from_crs("EPSG:4978", target.to_3d(), always_xy=True).transform(x, y, z)
    return np.asarray(np.stack(places, axis=1) + np.array([0.0, 0.0, lift_m]), dtype=np.float64)


def write_points(path: Path, points: Array, decimals: int, geographic: bool = False, header: str = "") -> None:
    """Write points (n, 3) as text, comma-separated if the name ends with .csv, or as LAS or LAZ."""
    if path.suffix in (".las", ".laz"):
        import laspy

        file = laspy.LasData(laspy.LasHeader(point_format=0, version="1.2"))
        file.header.offsets = np.floor(points.min(axis=0))
        file.header.scales = np.array([1e-9 if geographic else 10.0**-decimals] * 2 + [10.0**-decimals])
        file.x, file.y, file.z = points.T
        file.write(str(path))
        return
    first = decimals + 6 if geographic else decimals
    separator = "," if path.suffix == ".csv" else " "
    formats = [f"%.{first}f", f"%.{first}f", f"%.{decimals}f"]
    np.savetxt(path, points, fmt=formats, delimiter=separator, header=header, comments="", encoding="utf-8")


def main() -> None:
    """Write the soundings of a session as a software with a given entry exports them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("session", type=Path)
    parser.add_argument("run", type=Path)
    parser.add_argument("out", type=Path)
    for name in ("roll", "pitch", "heading"):
        parser.add_argument(f"--{name}-sign", type=float, default=1.0, choices=(1.0, -1.0))
    parser.add_argument("--order", default="hpr", help="order of the matrices, such as rph; default: hpr")
    parser.add_argument("--crs", default="EPSG:4978")
    parser.add_argument("--lift", type=float, default=0.0, help="added to all heights, m")
    parser.add_argument("--decimals", type=int, default=3)
    options = parser.parse_args()
    entry = entry_of(json.loads((options.run / "report" / "calibration.json").read_text(encoding="utf-8")))
    signs = (options.roll_sign, options.pitch_sign, options.heading_sign)
    turned = np.multiply(signs, entry.angles_deg)
    angles = (float(turned[0]), float(turned[1]), float(turned[2]))
    placed = georeferenced(recording(options.session), replace(entry, angles_deg=angles, order=options.order))
    from pyproj import CRS

    geographic = CRS.from_user_input(options.crs).is_geographic
    write_points(options.out, in_crs(placed, options.crs, options.lift), options.decimals, geographic)


if __name__ == "__main__":
    main()
