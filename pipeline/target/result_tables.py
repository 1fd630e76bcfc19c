"""Tables of stage segment: the pose of the target, the water in each pass, and the provisional mount."""

import numpy as np
import pandas as pd

from pipeline.artefacts.to_tables import xyz_columns
from pipeline.artefacts.water_levels import water_levels
from pipeline.config.target import Target
from pipeline.maths.geometry.trajectory import Trajectory
from pipeline.target.search_results import LocatedTarget, ProvisionalMount


def target_pose_table(target: LocatedTarget) -> pd.DataFrame:
    """Return the table ``target_pose`` (one row)."""
    sigma, tilt_sigma = np.sqrt(np.diag(target.pose.covariance)), np.sqrt(np.diag(target.tilt.covariance))
    row = {
        "R_target_from_pool": target.frame.R_target_from_pool.ravel().tolist(),
        "azimuth_correction_deg": np.degrees(target.azimuth_correction_rad),
        # The fit turns the points onto the model, so the target itself is tilted the opposite way.
        "tilt_x_deg": -np.degrees(target.tilt.parameters[0]),
        "tilt_y_deg": -np.degrees(target.tilt.parameters[1]),
        "sigma_azimuth_deg": np.degrees(sigma[0]),
        "sigma_tilt_x_deg": np.degrees(tilt_sigma[0]),
        "sigma_tilt_y_deg": np.degrees(tilt_sigma[1]),
        "rms_m": target.pose.rms_m,
        "points": target.pose.count,
        "agreement_m2": target.rival.agreement_m2,
        "rival_agreement_m2": target.rival.rival_agreement_m2,
        "rival": target.rival.name,
        "ambiguous": target.rival.ambiguous,
        "gate_m": target.gate_m,
        "within": target.within,
    }
    row |= xyz_columns("origin_{}_pool_m", target.frame.origin_pool_m) | xyz_columns("sigma_{}_m", sigma[1:])
    return pd.DataFrame([row])


def water_table(target: Target, trajectory: Trajectory, passes: pd.DataFrame) -> pd.DataFrame:
    """Return the table ``water_levels``.

    Parameters
    ----------
    target
        The target's settings.
    trajectory
        Poses of the body in the target frame.
    passes
        Table passes.
    """
    levels_m, ins_m = water_levels(target, trajectory, passes["start_ns"].to_numpy(), passes["end_ns"].to_numpy())
    return pd.DataFrame({"pass": passes["pass"], "level_m": levels_m, "ins_m": ins_m})


def provisional_mount_table(mount: ProvisionalMount) -> pd.DataFrame:
    """Return the table ``provisional_mount`` (one row)."""
    row = {
        "scale_m": mount.scale_m,
        "gate_m": mount.gate_m,
        "score": mount.score,
        "rival_score": mount.rival_score,
        "ambiguous": mount.ambiguous,
        "within": mount.within,
        "label_change": mount.label_change,
    }
    row |= xyz_columns("rotation_{}_deg", np.degrees(mount.rotation_vector_rad))
    row |= xyz_columns("lever_arm_{}_m", mount.lever_arm_correction_m)
    return pd.DataFrame([row])
