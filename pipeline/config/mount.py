"""A sensor's mount on the body, its uncertainty, and its source."""

from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field

from pipeline.config.quantities import Angle, Lever, Model, SigmaDeg, SigmaM


class Mount(Model):
    """Angles and lever arm of a sensor on the body: R_body_from_sensor = Rz(yaw) Rx(pitch) Ry(roll)."""

    roll_deg: Angle
    pitch_deg: Angle
    yaw_deg: Angle
    x_m: Lever
    y_m: Lever
    z_m: Lever


def _covariance(rows: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
    matrix = np.array(rows)
    sigma = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    size = np.outer(sigma, sigma)
    if np.any(np.abs(matrix - matrix.T) > 1e-6 * size) or np.any(np.abs(matrix) > (1 + 1e-6) * size):
        raise ValueError("must be symmetric, with no covariance above the product of its two sigmas")
    scale = np.where(sigma > 0, sigma, 1.0)
    if np.linalg.eigvalsh(matrix / np.outer(scale, scale))[0] < -1e-6:
        raise ValueError("must be positive semidefinite, as a covariance is")
    return rows


Entry = Annotated[float, Field(ge=-100, le=100)]
Covariance = Annotated[  # of (ε about body x, y, z; lever arm x, y, z), R_true = Exp(ε) R: rad and m
    tuple[Annotated[tuple[Entry, ...], Field(min_length=6, max_length=6)], ...],
    Field(min_length=6, max_length=6),
    AfterValidator(_covariance),
]


class CoarseMount(Model):
    """The coarse mount from which a fine calibration started; covariance None: the sigmas are in the pool's config."""

    mount: Mount
    covariance: Covariance | None = None


class MountOrigin(Model):
    """The source of a mount, which poolcal writes beside the mount."""

    method: Literal["coarse", "fine"]
    file: Annotated[str, Field(max_length=300)]
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    date: Annotated[str, Field(pattern="^[0-9]{4}-[0-9]{2}-[0-9]{2}$")]
    software: Annotated[str, Field(max_length=100)]
    held: tuple[Annotated[str, Field(max_length=10)], ...] = ()  # mount parameters for which it was not good enough
    coarse: CoarseMount | None = None  # with which the next calibration starts: no data count twice
    mount: Mount | None = None  # the mount as written: mount_covariance belongs to this mount only


class MountSigma(Model):
    """Standard deviations: one for each of the three angles, one for each component of the lever arm."""

    angle_deg: SigmaDeg = 0.005
    lever_arm_m: SigmaM = 0.0015
