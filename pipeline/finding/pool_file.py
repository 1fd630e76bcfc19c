"""A found place as a pool's config."""

import numpy as np

from pipeline.finding.place import DIGITS, FoundPlace

FIRST = "# A target found by poolcal target in the laser's points. Strike faces that are no wall below the water:"
AS_BUILT = """\
as_built:                       # of walls below the water that nobody has surveyed: fouled, weathered
  offset_sigma_m: 0.02
  angle_sigma_deg: 0.1
"""


def pool_yaml(place: FoundPlace) -> str:
    """Return the text of a pool's config with this target."""
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
        lines.append(f"    {face.name}: {{corners: [{corners}]}}")
    return "\n".join(lines) + "\n" + AS_BUILT
