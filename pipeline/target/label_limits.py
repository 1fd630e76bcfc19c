"""Conditions for labelling a sensor's points with a face, from the settings of stage segment."""

from dataclasses import replace

import numpy as np

from pipeline.config.pool import Segment
from pipeline.maths.target.labelling import LabelSettings


def laser_limits(settings: Segment, water_level_m: float, gate_m: float, beam_m: float) -> LabelSettings:
    """Return the conditions for laser points, which lie on dry faces.

    Parameters
    ----------
    settings
        Settings of stage segment.
    water_level_m
        Height of the water, target frame.
    gate_m
        Largest distance from the plane of the face.
    beam_m
        Diameter of the laser's beam at the target.
    """
    lowest_m = water_level_m + settings.water_margin_m
    return replace(_common(settings, gate_m), lowest_m=lowest_m, spot_m=beam_m / 2, seen="dry")


def sonar_limits(settings: Segment, water_level_m: float, gate_m: float) -> LabelSettings:
    """Return the conditions for soundings, which lie on wet faces.

    Parameters
    ----------
    settings
        Settings of stage segment.
    water_level_m
        Height of the water, target frame.
    gate_m
        Largest distance from the plane of the face.
    """
    highest_m = water_level_m - settings.water_margin_m
    half_widths = 2 * settings.side_lobe_widths
    return replace(_common(settings, gate_m), highest_m=highest_m, seen="wet", corner_factor=half_widths)


def _common(settings: Segment, gate_m: float) -> LabelSettings:
    grazing_rad = float(np.radians(settings.min_grazing_deg))
    return LabelSettings(gate_m, settings.margin_m, grazing_rad, ramp_m=settings.edge_ramp_m)
