"""What calibrating a sample of the session gives, as far as it gets."""

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
    """Tables of a trial calibration; None after the stage at which it stopped.

    Attributes
    ----------
    soundings : Stream
        Soundings, each with the face that it is on.
    target_pose, provisional_mount, freed : pd.DataFrame or None
        The pose of the target, the mount for labelling, and the adjustment's single-parameter tests.
    """

    soundings: Stream = EMPTY_STREAM
    target_pose: pd.DataFrame | None = None
    provisional_mount: pd.DataFrame | None = None
    freed: pd.DataFrame | None = None


Calibrate = Callable[[SessionConfig, PoolConfig, Raw], TrialCalibration]
