"""Targets of faces for sessions: a harbour wall, and any other."""

from typing import Any

Faces = dict[str, dict[str, Any]]


def of_faces(faces: Faces, azimuth_deg: float = 20.0) -> dict[str, Any]:
    """The blocks of a scenario with this target, and nothing behind it."""
    origin = {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0}
    target = {"kind": "faces", "origin": origin, "azimuth_deg": azimuth_deg, "faces": faces}
    return {"target": target, "surroundings": {"back_wall": False}}


DOCK = of_faces(  # a quay wall with two returns
    {
        "wall": {"corners": [[0, 3, -4], [0, -3, -4], [0, -3, 2], [0, 3, 2]]},
        "south": {"corners": [[0, -3, -4], [2, -5, -4], [2, -5, 2], [0, -3, 2]]},
        "north": {"corners": [[2, 5, -4], [0, 3, -4], [0, 3, 2], [2, 5, 2]]},
    }
)
MOUNT = {"pitch_deg": 1.2, "yaw_deg": -2.0, "y_m": 0.20, "z_m": -2.01}
BOTH_SIDES: dict[str, Any] = {  # a head that looks down and hears both sides, a scanner that sees both
    "mbes": {"mount": MOUNT | {"roll_deg": -1.8, "x_m": 0.30}, "sector_deg": 150.0},
    "laser": {"field_deg": [-130.0, 130.0]},
}
LOCK: dict[str, Any] = of_faces(  # a wall with a niche, and across the boat one that leans back
    {
        "right": {"corners": [[0, 4, -4], [0, -4, -4], [0, -4, 2], [0, 4, 2]]},
        "niche": {"corners": [[1.5, 5.5, -4], [0, 4, -4], [0, 4, 2], [1.5, 5.5, 2]]},
        "left": {"corners": [[-9, -4, -4], [-9, 4, -4], [-12, 4, 2], [-12, -4, 2]]},
    },
    azimuth_deg=163.0,
) | {"track": {"distances_m": [4.0, 5.0, 6.0, 7.0], "half_length_m": 6.0, "courses": ["along", "back"]}}
