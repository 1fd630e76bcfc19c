"""Figures of the INS's noise: sigmas of drift and white noise, from its files (table ins_sigmas) or session.yaml.

This module provides only these figures, and the table of the drift's figures as the data correct them.
pipeline/maths/adjustment/eliminate_drift.py eliminates the drift from the normal equations, drift_likelihood.py beside
it corrects the figures.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.config.session import Drift, Ins
from pipeline.maths.adjustment.drift_likelihood import DriftFigures, DriftPrior
from pipeline.maths.adjustment.pose_errors import PoseNoise
from pipeline.maths.geometry.passes import pass_of

AXES = {  # a figure of the drift is the root mean square of these columns of ins_sigmas
    "horizontal_m": ["north_m", "east_m"],
    "vertical_m": ["up_m"],
    "roll_pitch_deg": ["roll_deg", "pitch_deg"],
    "heading_deg": ["heading_deg"],
}


def sigmas_from_files(ins: Ins, ins_sigmas: pd.DataFrame, passes: pd.DataFrame) -> dict[str, float]:
    """Return the drift's sigmas from the INS files; empty if session.yaml takes precedence.

    They are medians over all records of ins_sigmas that lie in a pass.

    Parameters
    ----------
    ins : Ins
        The session's INS; ``drift_from`` decides which figures take precedence.
    ins_sigmas : DataFrame
        Table ins_sigmas.
    passes : DataFrame
        Table passes.
    """
    if ins.drift_from == "settings":
        return {}
    number = pass_of(*(table.to_numpy() for table in (ins_sigmas["t_ns"], passes["start_ns"], passes["end_ns"])))
    inside = ins_sigmas[number >= 0]
    return median_sigmas({name: inside[name].to_numpy(np.float64) for columns in AXES.values() for name in columns})


def median_sigmas(sigmas: Mapping[str, NDArray[Any]]) -> dict[str, float]:
    """Return the median of each drift figure, from the columns of ins_sigmas. Figures without values are left out."""
    squares = {name: np.mean([sigmas[axis] ** 2 for axis in columns], axis=0) for name, columns in AXES.items()}
    finite = {name: values[np.isfinite(values)] for name, values in squares.items()}
    return {name: float(np.sqrt(np.median(values))) for name, values in finite.items() if len(values)}


def drift_model(ins: Ins, ins_sigmas: pd.DataFrame, passes: pd.DataFrame) -> Drift:
    """Return the drift model: sigmas from the files if available, otherwise from session.yaml.

    The time constant is always that of session.yaml.

    Parameters
    ----------
    ins : Ins
        The session's INS.
    ins_sigmas : DataFrame
        Table ins_sigmas.
    passes : DataFrame
        Table passes.
    """
    return ins.drift.model_copy(update=sigmas_from_files(ins, ins_sigmas, passes))


def pose_noise(ins: Ins) -> PoseNoise:
    """Return the INS's white noise and drift in the target frame (z is up: a heading error is a turn about z)."""
    drift, white = ins.drift, ins.white
    angles = np.radians([drift.roll_pitch_deg, drift.roll_pitch_deg, drift.heading_deg])
    return PoseNoise(
        white=np.r_[[white.position_m] * 3, [np.radians(white.attitude_deg)] * 3],
        drift=np.r_[drift.horizontal_m, drift.horizontal_m, drift.vertical_m, angles],
        time_constant_s=drift.time_constant_s,
    )


def drift_prior(ins: Ins) -> DriftPrior:
    """Return how well the figures of the drift are known: the logarithms of the factors of ``ins.drift_within``."""
    within = ins.drift_within
    return DriftPrior(float(np.log(within.sigmas)), float(np.log(within.time_constant)))


def drift_figures_table(configured: PoseNoise, figures: DriftFigures) -> pd.DataFrame:
    """Return table ``drift_figures``.

    Parameters
    ----------
    configured : PoseNoise
        The pose errors by the session's figures.
    figures : DriftFigures
        Those by data and session.
    """
    table: dict[str, list[Any]] = {"figure": [*AXES, "time_constant_s"]}
    for column, noise in (("configured", configured), ("estimated", figures.noise)):
        horizontal, _, vertical, *angles = noise.drift.tolist()
        turns = np.degrees([angles[0], angles[2]]).tolist()
        table[column] = [horizontal, vertical, *turns, noise.time_constant_s]
    of_figure = [0, 0, 1, 1, 2]  # places among the logarithms: shifts, turns, time constant
    table["sigma_log"] = np.sqrt(np.diag(figures.covariance))[of_figure].tolist()
    return pd.DataFrame(table | {"deviation": figures.deviation[of_figure]})
