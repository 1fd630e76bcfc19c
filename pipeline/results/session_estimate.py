"""A session's estimate of the mount with all its errors, from the content of calibration.json."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.error_sources import OWNERS
from pipeline.config.verdict import VerdictLimits
from pipeline.limits.verdict_limits import largest_sigmas
from pipeline.maths.comparison import MountEstimate
from pipeline.maths.mount_parameters import N_MOUNT, PARAMETERS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SharableErrors:
    """Errors that belong to one thing: digest of its settings, effects (6,) by parameter, their correlation (n, n).

    Two sessions share them if both have the same digest; None: they never do. Correlation None: independent.
    """

    stated: str | None
    effects: Mapping[str, Array]
    correlation: Array | None

    def independent(self) -> Array:
        """Return the effects (6, n) of independent errors of variance one, whose sum has the same covariance.

        With E the effects and R = V diag(w) Vᵀ their correlation, they are the columns of E V diag(√w).
        """
        effects = np.array(list(self.effects.values())).reshape(-1, N_MOUNT).T
        if self.correlation is None:
            return effects
        values, vectors = np.linalg.eigh(self.correlation)
        return np.asarray(effects @ (vectors * np.sqrt(np.maximum(values, 0.0))))


NO_ERRORS = SharableErrors(None, {}, None)


@dataclass(frozen=True)
class SessionEstimate:
    """A session's estimate of the mount.

    Attributes
    ----------
    mount
        Rotation, lever arm, and the covariance from noise.
    covariance_total
        (6, 6): the covariance with the systematic errors.
    systematic
        The systematic errors by what they belong to; None: the version that wrote the result did not write them.
    limits
        (6,) rad and m: the largest total sigmas with which the session is accepted.
    """

    mount: MountEstimate
    covariance_total: Array
    systematic: Mapping[str, SharableErrors] | None
    limits: Array


def session_estimate(result: Mapping[str, Any]) -> SessionEstimate | None:
    """Return the adjustment's estimate of the mount, from the content of calibration.json; None if it has none.

    The estimates of the patent's methods have no covariance, and cannot be tested.
    """
    block = result["methods"]["adjustment"]
    if block["covariance"] is None or block["mount"] is None:
        return None
    shapes = {"R_body_from_mbes": (3, 3), "lever_arm_m": (3,), "covariance": (6, 6), "covariance_total": (6, 6)}
    R_body_from_mbes, lever_arm, covariance, total = (_array(block[name], shape) for name, shape in shapes.items())
    if not min(np.linalg.eigvalsh(matrix).min() for matrix in (covariance, total)) > 0:
        raise ValueError("a covariance is not positive")
    systematic = result.get("systematic")
    return SessionEstimate(
        mount=MountEstimate(R_body_from_mbes, lever_arm, covariance),
        covariance_total=total,
        systematic=None if systematic is None else {owner: _errors(systematic[owner]) for owner in OWNERS},
        limits=_limits(result.get("limits", {})),
    )


def _limits(block: Mapping[str, Any]) -> Array:
    """Return the limits (6,), rad and m, of the block ``limits``; an older version wrote two numbers, or none."""
    if "each" not in block:
        return largest_sigmas(VerdictLimits.model_validate(block))
    limits = np.zeros(N_MOUNT)
    for _, place, key, unit in PARAMETERS:
        limits[place] = np.radians(block["each"][key]) if unit == "deg" else block["each"][key]
    return _array(limits, (N_MOUNT,))


def _errors(block: Mapping[str, Any]) -> SharableErrors:
    effects = {str(name): _array(values, (N_MOUNT,)) for name, values in block["effects"].items()}
    correlation, n = block["correlation"], len(effects)
    stated = block["stated"]
    return SharableErrors(
        stated=None if stated is None else str(stated),
        effects=effects,
        correlation=None if correlation is None else _array(correlation, (n, n)),
    )


def _array(values: Any, shape: tuple[int, ...]) -> Array:
    array = np.array(values, dtype=np.float64).reshape(shape)
    if not np.isfinite(array).all():
        raise ValueError("a number is not finite")
    return array
