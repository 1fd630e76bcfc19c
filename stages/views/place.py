"""A recording of a found place: planes and laser points round the boat's track, to approve faces or to strike them.

Entities, in a frame with east, north and up, whose origin is the middle of the track at the height of the water:

    /faces/<name>/outline, points *    a face above the water, and some of its points, coloured by how far they lie off
    /faces/<name>/below                its part below the water: an assumption
    /refused/<n>                       a plane that cannot serve, and why
    /track                             the boat's
    /tables/place                      the table that is on the screen
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.atomic_files import write_bytes
from pipeline.finding.dry_plane import DryPlane
from pipeline.finding.place import FoundFace, FoundPlace
from pipeline.maths.surfaces.flatness import plane_axes
from stages.views.blueprint import place_blueprint
from stages.views.recording import DOT_M, GREY, LASER, SONAR, recording_content, text_document

Array = NDArray[np.float64]
OFF_M = 0.04  # points farther off their plane have the last colour
LINE_M = 0.02  # radius of a face's outline
INK, DARK = (20, 20, 20), (70, 75, 85)


def save_place(place: FoundPlace, said: str, path: Path) -> None:
    """Write a recording of a place to ``path``; ``said``: the text that is printed on the screen."""
    import rerun as rr

    origin = np.array([*place.boat_m, place.level_m])

    def draw(recording: Any) -> None:
        recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for face in place.faces:
            _face(recording, face, origin)
        served = {id(face.plane) for face in place.faces}
        others = [plane for plane in place.planes if id(plane) not in served and len(plane.outline_m)]
        for number, plane in enumerate(others, start=1):
            corners = plane.corners_m(plane.outline_m) - origin
            recording.log(f"refused/{number}", _outline(corners, DARK, LINE_M / 2, plane.refused), static=True)
        track = np.column_stack([place.track_m, np.full(len(place.track_m), place.level_m)]) - origin
        recording.log("track", rr.LineStrips3D([track.astype(np.float32)], radii=LINE_M, colors=LASER), static=True)
        recording.log("tables/place", text_document(said), static=True)

    write_bytes(path, recording_content("place", place_blueprint(), draw))


def _face(recording: Any, face: FoundFace, origin: Array) -> None:
    """Log a face above and below the water, and its points."""
    import rerun as rr

    plane = face.plane
    dry, whole = (plane.corners_m(outline) - origin for outline in (plane.outline_m, face.continued_m))
    recording.log(f"faces/{face.name}/outline", _outline(dry, INK, LINE_M, face.name), static=True)
    recording.log(f"faces/{face.name}/below", _outline(whole, SONAR, LINE_M / 2, ""), static=True)
    points, off_m = sample_points(plane)
    share = np.clip(off_m / OFF_M, -1.0, 1.0)[:, None]
    ends = np.where(share < 0, LASER, SONAR)
    colours = np.rint(GREY + np.abs(share) * (ends - np.array(GREY))).astype(np.uint8)
    cloud = rr.Points3D((points - origin).astype(np.float32), colors=colours, radii=DOT_M)
    recording.log(f"faces/{face.name}/points", cloud, static=True)


def _outline(corners_m: Array, colour: tuple[int, int, int], radius_m: float, label: str) -> Any:
    import rerun as rr

    closed = np.vstack([corners_m, corners_m[:1]]).astype(np.float32)
    return rr.LineStrips3D([closed], radii=radius_m, colors=colour, labels=[label] if label else None)


def sample_points(plane: DryPlane) -> tuple[Array, Array]:
    """Return the sample of a plane's points (k, 3), in the frame of the plane, and their distances (k,) from it.

    A sample is kept by its place a along the level axis e, its height z and its distance d off the plane n · x = D:
    x = a e + w u + (D + d) n, with w from the height, because e is level.
    """
    (level, up), n = plane_axes(plane.normal), plane.normal
    along, height, off = plane.sample_m.T
    w = (height - (plane.distance_m + off) * n[2]) / up[2]
    return along[:, None] * level + w[:, None] * up + (plane.distance_m + off)[:, None] * n, off
