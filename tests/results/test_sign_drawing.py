"""The drawing of the signs: where its arrows go and where a head looks, taken from the picture itself."""

import re
from itertools import pairwise

import numpy as np
import pytest

from pipeline.config.mount import Mount
from pipeline.mount import mount_of
from pipeline.results.pages.sign_drawing import sign_drawings


def drawings(sonar: bool = True, **settings: float) -> dict[str, str]:
    plain = {"roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0, "x_m": 0.3, "y_m": 0.2, "z_m": -2.0}
    views = sign_drawings(mount_of(Mount(**(plain | settings))), sonar)
    return {str(view["name"]): str(view["svg"]) for view in views}


def lines(svg: str) -> list[np.ndarray]:
    """Each polyline's points, to the right and up: both axes, then the curved arrow."""
    texts = re.findall(r'polyline points="(.*?)"', svg)
    return [np.array([pair.split(",") for pair in text.split()], float) * (1, -1) for text in texts]


def straight(svg: str) -> list[np.ndarray]:
    """The ends of each straight line, to the right and up: the lever arm, then the way the sonar looks."""
    ends = re.findall(r'<line x1="(.*?)" y1="(.*?)" x2="(.*?)" y2="(.*?)"', svg)
    return [np.array(one, float).reshape(2, 2) * (1, -1) for one in ends]


def test_arrows_go_where_the_words_say() -> None:
    """Starboard is right of the boat from behind and from above, the bow right from starboard and up from above."""
    views = drawings()
    roll, pitch, yaw = (lines(views[name])[2] for name in ("from behind", "from starboard", "from above"))
    assert roll[0][0] > 50
    assert all(b[1] < a[1] for a, b in pairwise(roll))  # starboard goes down
    assert pitch[0][0] > 50
    assert all(b[1] > a[1] for a, b in pairwise(pitch))  # the bow goes up
    assert yaw[0][1] > 50
    assert all(b[0] < a[0] for a, b in pairwise(yaw))  # the bow goes to port
    for name in views:
        to_the_right, up = lines(views[name])[:2]
        assert to_the_right[1][0] > 0
        assert up[1][1] > 0


@pytest.mark.parametrize(("roll_deg", "side"), [(-48.8, 1.0), (80.0, -1.0)])
def test_a_rolled_head_looks_to_its_side(roll_deg: float, side: float) -> None:
    """Rolled by -48.8°, its starboard side up, it looks down to starboard; by +80°, to port."""
    arm, look = straight(drawings(roll_deg=roll_deg)["from behind"])
    np.testing.assert_allclose(arm[1], look[0])
    across, up = look[1] - look[0]
    assert side * across == pytest.approx(30 * np.sin(np.radians(abs(roll_deg))), abs=0.2)
    assert up == pytest.approx(-30 * np.cos(np.radians(roll_deg)), abs=0.2)


def test_the_lever_arm_is_to_scale() -> None:
    views = drawings(x_m=1.0, y_m=-4.0, z_m=-2.0)
    ends = [straight(views[name])[0][1] for name in ("from behind", "from starboard", "from above")]
    unit = ends[0][0]
    assert unit > 0
    np.testing.assert_allclose(ends, np.array([[1, -2], [-4, -2], [1, -4]]) * unit, atol=0.11)


def test_a_laser_has_no_way_to_look() -> None:
    assert [len(straight(svg)) for svg in drawings(sonar=False).values()] == [1, 1, 1]
    assert [len(straight(svg)) for svg in drawings().values()] == [2, 2, 2]


def test_names_of_axes_stand_clear() -> None:
    """Letters are 13 high; a name of three is some 24 wide. No point of outline, axis or curved arrow lies in it."""
    for svg in drawings().values():
        outline = re.findall(r'polygon points="(.*?)"', svg)[0]
        corners = np.array([pair.split(",") for pair in outline.split()], float) * (1, -1)
        paths = [np.vstack([corners, corners[:1]]), *lines(svg)]
        dense = np.vstack([a + (b - a) * t for path in paths for a, b in pairwise(path) for t in np.linspace(0, 1, 60)])
        names = re.findall(r'<text x="(.*?)" y="(.*?)"[^>]*>([xyz]) \+<', svg)
        assert len(names) == 2
        for x, y, name in names:
            right, up = dense[:, 0] - float(x), dense[:, 1] + float(y)
            assert not np.any((np.abs(right) < 11) & (up > -1) & (up < 9)), name
