"""The result of calibrating a sample of the session, as far as the calibration goes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.artefacts.streams import EMPTY_STREAM, Stream
from pipeline.config.pool import PoolConfig
from pipeline.config.session import SessionConfig

Raw = Mapping[str, Mapping[str, NDArray[np.generic]]]  # canonical columns by sensor


@dataclass(frozen=True)
class TrialCalibration:
    """Tables of a trial calibration; None for tables that it did not reach.

    Attributes
    ----------
    soundings : Stream
        Soundings with their faces.
    target_pose, provisional_mount, freed : pd.DataFrame or None
        The target's pose, the provisional mount, and the adjustment's single-parameter tests.
    """

    soundings: Stream = EMPTY_STREAM
    target_pose: pd.DataFrame | None = None
    provisional_mount: pd.DataFrame | None = None
    freed: pd.DataFrame | None = None


Calibrate = Callable[[SessionConfig, PoolConfig, Raw], TrialCalibration]
