"""A found place as a pool's config, and a config with pieces of the bottom added."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
import yaml

from pipeline.config.found import Gaps
from pipeline.config.pool import PoolConfig
from pipeline.finding.bottom import BottomPiece
from pipeline.finding.place import DIGITS, FoundPlace
from pipeline.maths.target.bottom_names import BOTTOM

Face = TypeVar("Face")

FIRST = "# A target found by poolcal target in the laser's points. Strike faces that are no wall below the water:"
FIRST_OF_BOTTOM = "# A target of walls and pieces of the bottom, these by poolcal target --bottom."
AS_BUILT = """\
as_built:                       # of walls below the water that nobody has surveyed: fouled, weathered
  offset_sigma_m: 0.02
  angle_sigma_deg: 0.1
  bow_sigma_m: 0.005
  growth_sigma_m: 0.015         # a layer of one thickness on all walls: half of the thickest that may be there
"""


def pool_yaml(place: FoundPlace, gaps: Gaps = "repeated") -> str:
    """Return the text of a pool's config with this target; ``gaps``: which become masks."""
    lines = [
        FIRST,
        "# a fender, a ladder, a moored boat. Below the water each goes on as above: the soundings test that.",
        "target:",
        "  kind: faces",
        "  found: true",
        f"  origin: {{latitude_deg: {place.latitude_deg:.9f}, longitude_deg: {place.longitude_deg:.9f}, "
        f"height_m: {place.height_m:.3f}}}",
        f"  azimuth_deg: {place.azimuth_deg:.3f}",
        f"  water_level_m: {place.water_level_m:.3f}",
        "  faces:                        # corners in m: x into the largest wall, y along it, z up",
    ]
    for face in place.faces:
        rows = np.round(face.corners_m, DIGITS) + 0.0  # no -0.0
        corners = ", ".join("[" + ", ".join(f"{value:.{DIGITS}f}" for value in row) + "]" for row in rows)
        kinds = {"repeated": (face.below_m, face.gaps_m), "seen": (face.gaps_m,), "none": ()}[gaps]
        heights = [f"{{height_m: [{low:.{DIGITS}f}, {high:.{DIGITS}f}]}}" for kind in kinds for low, high in kind]
        masks = f", masks: [{', '.join(heights)}]" if heights else ""
        lines.append(f"    {face.name}: {{corners: [{corners}]{masks}}}")
    return "\n".join(lines) + "\n" + AS_BUILT


def walls_of(faces: Mapping[str, Face]) -> dict[str, Face]:
    """Return the faces without the pieces of the bottom, which are found anew."""
    return {name: face for name, face in faces.items() if not name.startswith(BOTTOM)}


def with_bottom_yaml(pool: PoolConfig, pieces: Sequence[BottomPiece]) -> str:
    """Return the text of a config with pieces of the bottom as faces of its target that the sonar alone sees."""
    content: dict[str, Any] = pool.model_dump(mode="json", exclude_defaults=True)
    bottom = {
        f"{BOTTOM}{k}": {"corners": np.round(piece.corners_m, DIGITS).tolist(), "seen": "wet"}
        for k, piece in enumerate(pieces, start=1)
    }
    content["target"] |= {"kind": "faces", "faces": walls_of(content["target"]["faces"]) | bottom}
    if pool.verdict.purpose != "pool":  # what it is judged for is told in full
        told = {"purpose", "depth_m", "swath_deg", "mount_share"}
        content["verdict"] |= pool.verdict.model_dump(mode="json", include=told)
    text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True, default_flow_style=None)
    return f"{FIRST_OF_BOTTOM}\n{text}"
