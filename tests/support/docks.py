"""A harbour wall for sessions without a drawn target."""

from typing import Any

DOCK: dict[str, Any] = {  # a quay wall with two returns, and nothing else
    "target": {
        "kind": "faces",
        "origin": {"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 12.0},
        "azimuth_deg": 20.0,
        "faces": {
            "wall": {"corners": [[0, 3, -4], [0, -3, -4], [0, -3, 2], [0, 3, 2]]},
            "south": {"corners": [[0, -3, -4], [2, -5, -4], [2, -5, 2], [0, -3, 2]]},
            "north": {"corners": [[2, 5, -4], [0, 3, -4], [0, 3, 2], [2, 5, 2]]},
        },
    },
    "surroundings": {"back_wall": False},
}
