"""``poolcal compare``: a simulated session's result beside its truth.

The error of the rotation is the vector ε in R_true = Exp(ε) · R_body_from_mbes, about the body's axes. The covariance
is that of the same vector. The answer is yes if the calibration was accepted and each of the result's six errors is
within LIMIT sigmas. A method without sigmas is judged by the largest sigmas that the verdict allows.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.atomic_files import read_json
from pipeline.config.mount import Mount
from pipeline.config.verdict import VerdictLimits
from pipeline.errors import ConfigError
from pipeline.limits.verdict_limits import in_report_units, largest_sigmas
from pipeline.maths.comparison import mount_error
from pipeline.maths.mount_parameters import PARAMETERS, SETTINGS
from pipeline.mount import Mounted
from pipeline.run.output_files import as_written
from pipeline.run.results import calibration
from pipeline.run.settings import read_settings
from pipeline.text_table import text_table
from stages.commands.answer import print_answer

LIMIT = 4.0
Array = NDArray[np.float64]


def command(run: Path, truth_path: Path) -> int:
    """Print a run's result beside the truth in a file; return 1 if it was rejected, or an error exceeds its limit."""
    return print_answer(*compare_with_truth(run, truth_path))


def compare_with_truth(run: Path, truth_path: Path) -> tuple[str, bool]:
    """Return the comparison as text, and whether the result was accepted and all errors are within their limits."""
    result, settings = calibration(run), read_settings(run)
    R_true, lever_arm_true_m = read_truth(truth_path)
    chosen = settings.pool.result
    with as_written(run):
        _refuse_damaged(result, chosen)
    values = result["methods"][chosen]
    error, sigma = errors_of(values, R_true, lever_arm_true_m), _sigma_of(values)
    lines = [f"session {result['session']}: {result['verdict']}", *(f"  {reason}" for reason in result["reasons"])]
    lines += ["", f"{chosen} (the result)"]
    lines += _table(settings.session.sonar.mount, values, R_true, lever_arm_true_m, sigma)
    rows = [
        (f"  {method}", *_error_cells(errors_of(other, R_true, lever_arm_true_m)))
        for method, other in result["methods"].items()
    ]
    heads = ("errors of all:", *(name for name, *_ in PARAMETERS), "(deg, m)")
    lines += ["", *text_table(f"<21{'>10' * len(PARAMETERS)}   <1", heads, rows)]
    lines += [f"  {method}: {other['warning']}" for method, other in result["methods"].items() if other.get("warning")]
    limit = LIMIT * (_largest(settings.pool.verdict) if sigma is None else sigma)
    within = error is not None and bool(np.all(np.abs(error) <= limit))
    accepted = result["verdict"] == "accepted"
    bound = "sigma" if sigma is not None else "the largest sigma allowed"
    lines += ["", "error: truth minus calibrated; of angles, the rotation from calibrated to true, body axes"]
    how = f"{'every error is' if within else 'an error is not'} within {LIMIT:g} {bound}"
    lines.append(f"{chosen}: {how if accepted else 'the calibration was rejected'}")
    return "\n".join(lines), accepted and within


def _refuse_damaged(result: dict[str, Any], chosen: str) -> None:
    """Convert all values once, so that damaged values raise an error before anything is computed from them."""
    for values in (result["methods"][chosen], *result["methods"].values()):
        if values["R_body_from_mbes"] is not None and values["lever_arm_m"] is not None:
            R = np.array(values["R_body_from_mbes"], dtype=np.float64).reshape(3, 3)
            if not np.allclose(R @ R.T, np.eye(3), atol=1e-6):
                raise ValueError("no rotation")
            np.array(values["lever_arm_m"], dtype=np.float64).reshape(3)
            for key in SETTINGS:
                float(values["mount"][key])
        sigma = _sigma_of(values)
        if sigma is not None:
            sigma.reshape(6)
    " ".join(result["reasons"])


def _error_cells(error: Array | None) -> list[str]:
    return ["no result"] if error is None else [f"{error[index]:.5f}" for _, index, *_ in PARAMETERS]


def read_truth(path: Path) -> tuple[Array, Array]:
    """Return the true rotation R_body_from_mbes (3, 3) and lever arm (3,), m, body axes, from the simulator's file."""
    try:
        content: Any = read_json(path)
        mbes = content["mbes"]
        R_body_from_mbes = np.array(mbes["R_body_from_mbes"], dtype=np.float64).reshape(3, 3)
        return R_body_from_mbes, np.array(mbes["lever_arm_m"], dtype=np.float64).reshape(3)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}); name the OUT.truth.json meant") from error
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{path}: is no truth ({error!r}); name the OUT.truth.json meant") from error


def errors_of(values: dict[str, Any], R_true: Array, lever_arm_true_m: Array) -> Array | None:
    """Return the errors of a method's mount, true minus calibrated; None if the method has no mount.

    Parameters
    ----------
    values
        A method's block of calibration.json.
    R_true, lever_arm_true_m
        The true R_body_from_mbes (3, 3) and lever arm (3,), m, body axes.

    Returns
    -------
    array
        (6,): rotation vector about the body's axes in degrees, and lever arm in m.
    """
    if values["R_body_from_mbes"] is None or values["lever_arm_m"] is None:
        return None
    error = mount_error(R_true, lever_arm_true_m, np.array(values["R_body_from_mbes"]), np.array(values["lever_arm_m"]))
    return np.asarray(error * np.repeat([np.degrees(1.0), 1.0], 3))


def _sigma_of(values: dict[str, Any]) -> Array | None:
    sigma = values["sigma"]
    if sigma is None or sigma["rotation_vector_deg"] is None or sigma["lever_arm_m"] is None:
        return None
    return np.array([*sigma["rotation_vector_deg"], *sigma["lever_arm_m"]], dtype=np.float64)


def _largest(verdict: VerdictLimits) -> Array:
    return in_report_units(largest_sigmas(verdict))


def _table(
    coarse: Mount, values: dict[str, Any], R_true: Array, lever_arm_true_m: Array, sigma: Array | None
) -> list[str]:
    error = errors_of(values, R_true, lever_arm_true_m)
    if error is None:
        return ["  no result"]
    truth = Mounted(R_true, lever_arm_true_m).settings()
    rows = []
    for name, k, key, unit in PARAMETERS:
        spread = ("-", "-") if sigma is None else (f"{sigma[k]:.5f}", f"{error[k] / sigma[k]:.1f}")
        numbers = (f"{value:.5f}" for value in (getattr(coarse, key), values["mount"][key], truth[key], error[k]))
        rows.append((name, *numbers, *spread, unit))
    heads = ("", "coarse", "calibrated", "truth", "error", "sigma", "error/sigma")
    return text_table("  <6>11>12>11>11>10>13 <1", heads, rows)
