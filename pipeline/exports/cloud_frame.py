"""The frame of exported points: the pool's, or a projected CRS in the datum of the INS's positions."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.errors import ConfigError
from pipeline.georeference.pool_context import pool_frame_of
from pipeline.maths.target.model import TargetFrame
from pipeline.readers.crs import projected_from_ecef

Array = NDArray[np.float64]
POOL = "pool (x, y, z of CONVENTIONS.md)"


@dataclass(frozen=True)
class CloudFrame:
    """A frame for points.

    name: its name; crs: its CRS, None for the pool frame; offset (3,): round numbers that coordinates are stored from;
    from_target: turns points (n, 3) of the target frame into coordinates (n, 3).
    """

    name: str
    crs: Any
    offset: Array
    from_target: Callable[[Array], Array]

    def coordinates(self, points_target_m: Array) -> Array:
        """Return the coordinates as rows x, y, z (3, n); raise ConfigError if the CRS has none there."""
        points = self.from_target(points_target_m).T
        if not np.isfinite(points).all():
            raise ConfigError(f"--crs {self.name}: has no coordinates at the pool; name the CRS of its zone")
        return points


def cloud_frame(name: str | None, target: TargetFrame, pool_frame: pd.DataFrame) -> CloudFrame:
    """Return the frame by its name; None: the pool frame.

    Parameters
    ----------
    name
        A projected CRS, such as EPSG:32651. Its datum is taken to be that of the INS's positions; heights are
        ellipsoidal.
    target
        The target in the pool frame.
    pool_frame
        Table ``pool_frame``.
    """
    if name is None:
        return CloudFrame(POOL, None, np.zeros(3), target.points_to_pool)
    crs, from_ecef = projected_from_ecef(name, "--crs")
    frame = pool_frame_of(pool_frame)

    def from_target(points_target_m: Array) -> Array:
        return from_ecef(frame.points_to_ecef(target.points_to_pool(points_target_m)))

    offset = np.round(from_target(np.zeros((1, 3)))[0])
    if not np.isfinite(offset).all():
        raise ConfigError(f"--crs {name}: has no coordinates at the pool; name the CRS of its zone")
    return CloudFrame(name, crs, offset, from_target)
