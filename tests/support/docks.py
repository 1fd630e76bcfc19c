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
