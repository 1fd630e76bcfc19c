"""The parts of the report that only a calibration of the laser has."""

from collections.abc import Mapping

import numpy as np

from pipeline.config.pool import Segment
from pipeline.config.session import Laser
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.mount import mount_of
from pipeline.report.ambiguities import MountSearch
from pipeline.report.evidence import Evidence
from pipeline.report.method_blocks import adjustment_block
from pipeline.report.sensor_report import SensorReport
from pipeline.target.laser_search import LARGEST_TURN


def laser_report(laser: Laser, evidence: Evidence, segment: Segment) -> SensorReport:
    """Return the laser's parts of a report.

    Parameters
    ----------
    laser : settings of the laser
    evidence : tables of the run
    segment : limits of the search for the provisional mount
    """
    coarse, fixed = mount_of(laser.mount), evidence.fixed
    block = adjustment_block(evidence.estimate, evidence.covariance, evidence.summary, coarse, "laser")
    methods = {"adjustment": block}
    return SensorReport(
        coarse=coarse,
        methods=methods,
        method="adjustment",
        search=MountSearch(
            sensor="laser", max_angle_deg=LARGEST_TURN * segment.search_laser_deg, max_lever_arm_m=np.inf
        ),
        sides="the target's left and right",
        advice=_advice(fixed),
        result_keys={"calibrated": "laser", "laser": block, "methods": methods, "held": fixed},
    )


def _advice(fixed: Mapping[str, float]) -> str:
    """Return in words the mount parameters that keep their coarse values, and what would help; empty if none does."""
    if not fixed:
        return ""
    verb, pronoun, values = ("is", "it", "value") if len(fixed) == 1 else ("are", "them", "values")
    angles = [name for name, _, _, unit in PARAMETERS if unit == "deg"]
    with_sigmas = [
        f"{name} (±{sigma:.3f}°)" if name in angles else f"{name} (±{1000 * sigma:.0f} mm)"
        for name, sigma in fixed.items()
    ]
    return (
        f"{', '.join(with_sigmas)} {verb} held at the coarse {values}: this target and these passes cannot give "
        f"{pronoun} within the verdict's limits; a surveyed target (laser_fit.origin_sigma_m, azimuth_sigma_deg), more "
        "passes at other distances, or a less drifting INS would"
    )
