"""The library that finds nearest points, without what its import brings beside."""

import subprocess
import sys

from tests.support.roots import ROOT


def test_open3d_comes_without_its_pages_for_a_browser() -> None:
    """They take more than half of its import. Whoever imports them later finds them whole."""
    code = (
        "import sys; from pipeline.target.surface import ClosestSurface; from tests.support.targets import by_letters;"
        "surface = ClosestSurface(by_letters(10.0, 2.0, 0.9, 0.3)); assert 'dash' not in sys.modules;"
        "from open3d.visualization.draw_plotly import draw_plotly; sys.exit(not callable(draw_plotly))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
