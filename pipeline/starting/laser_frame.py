"""The frame of the laser's points: the scanner's own, or a CRS if they are georeferenced."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.checking.file_checks import FAR_M
from pipeline.config.fill_in import MARK
from pipeline.errors import ConfigError, RawDataError
from pipeline.readers import file_kind
from pipeline.readers.crs import ECEF, LASER_FRAME, LaserFrame, frame_transform
from pipeline.readers.declared_crs import CLEARLY_ELSEWHERE_M
from pipeline.readers.e57_scans import read_scans
from pipeline.readers.las import crs_of_las
from pipeline.starting.boat_track import BoatTrack
from pipeline.starting.file_groups import FileGroup

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FrameProposal:
    """``laser.frame`` and ``laser.heights`` of session.yaml (MARK: a person must decide), and the reason."""

    frame: str
    why: str
    heights: str | None = None


def propose_frame(group: FileGroup, folder: Path, track: BoatTrack | None) -> FrameProposal:
    """Return the frame of the laser's points.

    Points less than 10 km from their origin are in the scanner's frame, unless the file declares a CRS. A CRS, declared
    or ECEF, is proposed only if it brings the points to within 1 km of the INS.

    Parameters
    ----------
    group
        The laser's files.
    folder
        The session folder.
    track
        The INS's positions; None: there are none.
    """
    medians = [np.array([np.median(file.columns[axis]) for axis in ("x_m", "y_m", "z_m")]) for file in group.files]
    declared = {text for file in group.files if (text := _declared(group, folder, file.name))}
    far = [bool(np.abs(median).max() > FAR_M) for median in medians]
    if not any(far) and not declared:
        return FrameProposal(LASER_FRAME, "the points lie near their origin, as in a scanner's own frame")
    if len(declared) > 1 or len(set(far)) > 1:
        return FrameProposal(MARK, "the files are not all in one frame; export them in one")
    where = ", ".join(f"{value:.0f}" for value in medians[0])
    if track is None:
        return FrameProposal(MARK, f"the points lie round ({where}), and there is no INS to compare with")
    if not declared:
        if all(_near(median, track) for median in medians):
            return FrameProposal(ECEF, "the points lie within 1 km of the INS if they are earth-centred (ECEF)")
        return FrameProposal(MARK, f"the points lie round ({where}), and no file names their CRS")
    return _by_declaration(declared.pop(), medians, track)


def _by_declaration(wkt: str, medians: list[Array], track: BoatTrack) -> FrameProposal:
    from pyproj import CRS

    crs = CRS.from_user_input(wkt)
    says = f"the files say {crs.name}"
    code = crs.to_epsg()
    if code is None:
        return FrameProposal(MARK, f"{says}, which has no EPSG number")
    frame = f"EPSG:{code}"
    try:
        own_heights = len(crs.axis_info) == 3
        transform = frame_transform(LaserFrame(frame, None if own_heights else "ellipsoidal"))
    except ConfigError as error:
        return FrameProposal(MARK, f"{says} ({frame}): {str(error).partition(': ')[2]}")
    to_ecef = (lambda *xyz: xyz) if transform is None else transform.to_ecef
    if not all(_near(np.stack(to_ecef(*median[:, None])).ravel(), track) for median in medians):
        return FrameProposal(MARK, f"{says} ({frame}), in which the points do not lie within 1 km of the INS")
    return FrameProposal(frame, f"{says}, and the points lie within 1 km of the INS", None if own_heights else MARK)


def _near(point_ecef_m: Array, track: BoatTrack) -> bool:
    return bool(np.linalg.norm(point_ecef_m - track.mean_ecef_m) < CLEARLY_ELSEWHERE_M)


def _declared(group: FileGroup, folder: Path, name: str) -> str:
    """Return the CRS that a file declares, WKT; empty without one."""
    try:
        if group.kind is file_kind.LAS:
            return crs_of_las(folder / name, name)
        return read_scans(folder / name, name)[1] if group.kind is file_kind.E57 else ""
    except RawDataError:
        return ""
