"""The parts of the report that only a calibration of the laser has."""

import numpy as np

from pipeline.config.pool import LaserFit, Segment
from pipeline.config.session import Laser
from pipeline.config.verdict import VerdictLimits
from pipeline.mount import mount_of
from pipeline.report.ambiguities import MountSearch
from pipeline.report.coarse_mount import share_of_coarse_mount
from pipeline.report.evidence import Evidence
from pipeline.report.method_blocks import adjustment_block
from pipeline.report.sensor_report import SensorReport
from pipeline.target.laser_search import LARGEST_TURN


def laser_report(
    laser: Laser, evidence: Evidence, segment: Segment, limits: VerdictLimits, settings: LaserFit
) -> SensorReport:
    """Return the laser's parts of a report.

    Parameters
    ----------
    laser : settings of the laser
    evidence : tables of the run
    segment : limits of the search for the provisional mount
    limits : limits of the total sigmas
    settings : what counts as better than the coarse mount
    """
    coarse = mount_of(laser.mount)
    block = adjustment_block(evidence.estimate, evidence.covariance, evidence.summary, coarse, "laser")
    methods = {"adjustment": block}
    share = share_of_coarse_mount(
        block["sigma_mount_total"], evidence.estimate, evidence.freed, limits, settings.hold_share
    )
    return SensorReport(
        coarse=coarse,
        methods=methods,
        method="adjustment",
        search=MountSearch(
            sensor="laser", max_angle_deg=LARGEST_TURN * segment.search_laser_deg, max_lever_arm_m=np.inf
        ),
        sides="the target's left and right",
        advice=share.advice,
        held=share.held,
        result_keys={
            "calibrated": "laser",
            "laser": block,
            "methods": methods,
            "held": share.held,
            "rests_on_coarse": list(share.unimproved),
        },
    )
