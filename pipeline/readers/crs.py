"""Points in a coordinate reference system -> ECEF (EPSG:4978), metres."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import ConfigError

Array = NDArray[np.float64]
Transform = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
ECEF = "EPSG:4978"
LASER = "laser"


@lru_cache(maxsize=8)
def to_ecef(frame: str) -> Transform | None:
    """What turns x, y, z (or longitude, latitude, height) of the CRS ``frame`` into ECEF; None where nothing is to do.

    Raises
    ------
    ConfigError
        ``frame`` is no CRS, has no heights, or its way to ECEF needs a grid that is not installed: PROJ's guess would
        be wrong by metres.
    """
    if frame in (LASER, ECEF):
        return None
    from pyproj import CRS
    from pyproj.exceptions import ProjError

    where = f"session.yaml: laser.frame = {frame!r}"
    try:
        crs = CRS.from_user_input(frame)
        if len(crs.axis_info) != 3:
            raise ConfigError(
                f"{where}: {crs.name} has {len(crs.axis_info)} axes, so heights would be undefined; export the points "
                "in EPSG:4978 (or 4979), or name a CRS with heights"
            )
        transform = _transformer(crs)
    except ProjError as error:
        raise ConfigError(
            f"{where}: is no coordinate reference system ({error}); write laser, EPSG:4978 or the like"
        ) from error
    if transform is None:
        raise ConfigError(
            f"{where}: {crs.name} cannot be turned into ECEF here (no geocentric relation, or no geoid grid); "
            "export the points in EPSG:4978 or with ellipsoidal heights in EPSG:4979"
        )
    return transform


def _transformer(crs: object) -> Transform | None:
    import warnings

    from pyproj import CRS
    from pyproj.transformer import TransformerGroup

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a missing grid: refused by the caller
        group = TransformerGroup(crs, CRS.from_user_input(ECEF), always_xy=True, allow_ballpark=False)
    if not group.transformers or not group.best_available:
        return None
    best = group.transformers[0]

    def transform(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        # PROJ writes into the arrays it is given, and marks what it cannot turn by inf
        moved = best.transform(x, y, z, inplace=False)
        return np.asarray(moved[0]), np.asarray(moved[1]), np.asarray(moved[2])

    return transform
