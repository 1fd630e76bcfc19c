"""Warnings about the noise: families that differ, soundings that depend on each other, sigmas that data contradict."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from pipeline.maths.adjustment.parameters import kind_of
from pipeline.maths.adjustment.score_check import largest_ratio
from pipeline.maths.mount_parameters import MOUNT_NAMES, MOUNT_WORDS, N_MOUNT
from pipeline.report.reason_codes import ReasonCode, Statement

# Largest ratio of the noise on a family to that on the sensor's others. A beam of 1° along track spreads over 10 cm of
# slant range on a face at 45° to it, six metres away: twice or three times the wall's noise is usual. A laser's noise
# grows as the intensity of its echo falls, to twice at grazing incidence.
USUAL_RATIO = {"laser": 2.0, "mbes": 3.0}
CERTAIN = 3.0  # sigmas by which a ratio must exceed the usual one
MAX_DESIGN_EFFECT = 1.5  # of the soundings of a ping
MAX_SIGMA_RATIO = 1.2  # of a sigma by the scatter of slots of time to the sigma of the model


def points_of(sensor: str) -> str:
    """Return words for a sensor's points.

    >>> points_of("mbes"), points_of("mbes_2")
    ('soundings', 'soundings of mbes_2')
    """
    words = {"laser": "laser points", "mbes": "soundings"}
    return words.get(sensor, f"soundings of {sensor}")


def uneven_noise(groups: pd.DataFrame) -> Iterator[Statement]:
    """Yield a warning for each family on which a sensor's noise is far larger than on its others (table ``groups``)."""
    families = groups[(groups["family"] != "") & (groups["variance_factor"] > 0)]
    for sensor, rows in families.groupby("sensor", sort=True):
        factor, family = rows["variance_factor"].to_numpy(), rows["family"].tolist()
        information = (factor / rows["sigma"].to_numpy()) ** 2
        for k, name in enumerate(family):
            others = np.arange(len(family)) != k
            if not others.any():
                continue
            usual = float(information[others] @ factor[others] / information[others].sum())
            uncertainty = float(np.sqrt(1 / information[k] + 1 / information[others].sum()))  # of the ratio's logarithm
            ratio = factor[k] / usual
            most = USUAL_RATIO[kind_of(str(sensor))]
            if np.log(ratio) - CERTAIN * uncertainty > 2 * np.log(most):
                words = (
                    f"{points_of(str(sensor))} on {name} scatter {np.sqrt(ratio):.1f} times as much as on the other "
                    f"faces (up to {most:g} times is usual): look at their residuals; the sigmas allow for it"
                )
                yield Statement(ReasonCode.NOISE_DIFFERS_BY_FAMILY, words)


def correlated_beams(groups: pd.DataFrame) -> Iterator[Statement]:
    """Yield a warning if soundings of a ping are far from independent (table ``groups``)."""
    effect = groups[["mean_effect", "slope_effect"]].max(axis=1)
    rows = groups[effect > MAX_DESIGN_EFFECT]
    if len(rows):
        words = (
            f"neighbouring beams err alike on {', '.join(rows['family'])}: of up to {effect.max():.1f} soundings of a "
            "ping only one counts; the sigmas allow for it"
        )
        yield Statement(ReasonCode.BEAMS_CORRELATED, words)


def sigmas_too_small(estimate: pd.DataFrame, level: float) -> Iterator[Statement]:
    """Yield a warning if slots of time scatter certainly more than a mount parameter's sigma says.

    Parameters
    ----------
    estimate : DataFrame
        Table estimate.
    level : float
        Chance of a warning where all six sigmas are too small by just MAX_SIGMA_RATIO.
    """
    found = []
    words_of = dict(zip(MOUNT_NAMES, MOUNT_WORDS, strict=True))
    for row in estimate[estimate["slots_dof"] > 0].to_dict("records"):
        ratio, dof = row["slots_ratio"], row["slots_dof"]
        if ratio > MAX_SIGMA_RATIO**2 * largest_ratio(dof, level / N_MOUNT):
            spread = np.sqrt(ratio / (2 * dof))
            found.append(f"{words_of[row['unknown']]} {np.sqrt(ratio):.1f} ± {spread:.1f} times ({dof:.0f} slots)")
    if found:
        words = (
            f"stretches of one second scatter more than the random sigmas say: {', '.join(found)}; errors that "
            "neighbouring pings share, or uneven faces"
        )
        yield Statement(ReasonCode.SIGMAS_OFF_SCATTER, words)
