"""Mount angles and lever arms: R_body_from_sensor = Rz(yaw) Rx(pitch) Ry(roll)."""

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.config.mount import Mount
from pipeline.simulation.random_streams import generator
from pipeline.simulation.scenario_laser import LaserScenario
from pipeline.simulation.scenario_mbes import MbesScenario
from pipeline.simulation.site import Floats


def R_body_from_sensor(mount: Mount) -> Rotation:
    """Return the rotation from the sensor's frame to the body: Rz(yaw) Rx(pitch) Ry(roll)."""
    return Rotation.from_euler("ZXY", [mount.yaw_deg, mount.pitch_deg, mount.roll_deg], degrees=True)


def lever_arm_m(mount: Mount) -> Floats:
    """Return the sensor's origin in the body frame, (3,), m."""
    return np.array([mount.x_m, mount.y_m, mount.z_m])


def coarse_error(scenario: LaserScenario | MbesScenario, seed: int, head: int = 0) -> Mount:
    """Return coarse minus true mount: the scenario's ``coarse_error``, or else its two sizes with random signs.

    Parameters
    ----------
    scenario : LaserScenario or MbesScenario
        The laser, or a head of the sonar.
    seed : int
        Seed of the session.
    head : int
        Number of the head, from 0.
    """
    if scenario.coarse_error is not None:
        return scenario.coarse_error
    noise = "coarse" if isinstance(scenario, MbesScenario) else "coarse_laser"
    signs = generator(seed, noise, head).choice([-1.0, 1.0], 6)
    sizes = [scenario.coarse_angle_deg] * 3 + [scenario.coarse_lever_m] * 3
    names = Mount.model_fields
    return Mount(**{name: float(sign * size) for name, sign, size in zip(names, signs, sizes, strict=True)})


def coarse_mount(scenario: LaserScenario | MbesScenario, seed: int, head: int = 0) -> Mount:
    """Return the mount in session.yaml: true mount plus coarse error; parameters as for :func:`coarse_error`."""
    true, error = scenario.mount.model_dump(), coarse_error(scenario, seed, head).model_dump()
    return Mount(**{name: round(true[name] + error[name], 12) for name in true})
