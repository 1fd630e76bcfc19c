"""What a campaign's errors say about its sigmas: mean normalised squared error, RMS ÷ sigma, mean errors."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import chi2

from tools.session_rows import NAMES

Array = NDArray[np.float64]
LEVEL = 0.99  # probability of the band
UNBIASED = 2.6  # a mean error of so many standard errors has a probability of 1 %
HEAD = (
    "| campaign | sessions | accepted | mean NSE (99 % band) | of the accepted | by total sigmas "
    f"| RMS ÷ σ: {', '.join(NAMES)} | mean ÷ its standard error: {', '.join(NAMES)} |"
)


def nse_band(count: int) -> tuple[float, float]:
    """Return the band in which the mean normalised squared error of so many sessions lies with 99 % probability.

    If the covariances are true, the sum over n sessions is chi-squared with 6 n degrees of freedom.
    """
    low, high = chi2.ppf([(1 - LEVEL) / 2, (1 + LEVEL) / 2], len(NAMES) * count) / count
    return float(low), float(high)


@dataclass(frozen=True)
class Statistics:
    """The statistics of a campaign.

    Attributes
    ----------
    sessions, accepted, without_result
        Numbers of sessions. All figures below are of those with a result, accepted or not.
    nse
        Mean normalised squared error by the random covariance; 6 is expected.
    nse_accepted
        The same of the accepted sessions.
    nse_total
        The same, of all sessions, by the total covariance: below 6 where what is considered is larger than what is
        simulated.
    ratios
        (6,): RMS error ÷ RMS of the random sigmas.
    means
        (6,): mean errors, each divided by its standard error s / √n, s the errors' standard deviation.
    """

    sessions: int
    accepted: int
    without_result: int
    nse: float
    nse_accepted: float
    nse_total: float
    ratios: Array
    means: Array

    @property
    def band(self) -> tuple[float, float]:
        """Band of the mean normalised squared error."""
        return nse_band(self.sessions - self.without_result)

    @property
    def in_band(self) -> bool:
        """Whether the mean normalised squared error lies in its band."""
        low, high = self.band
        return low <= self.nse <= high

    @property
    def biased(self) -> list[str]:
        """Parameters whose mean error is farther from zero than chance allows."""
        return [name for name, mean in zip(NAMES, self.means, strict=True) if abs(mean) > UNBIASED]


def statistics_of(table: pd.DataFrame, prefix: str = "") -> Statistics:
    """Return the statistics of a campaign's rows.

    Parameters
    ----------
    table
        Columns ``accepted``, and with the prefix ``nse``, ``nse_total``, and ``error_`` and ``sigma_`` of each
        parameter; NaN: the session has no result.
    prefix
        Beginning of the columns' names, where rows hold more than one mount.
    """
    found = table[table[f"{prefix}nse"].notna()]
    errors, sigmas = (found[[f"{prefix}{kind}_{name}" for name in NAMES]].to_numpy() for kind in ("error", "sigma"))
    return Statistics(
        sessions=len(table),
        accepted=int(table["accepted"].sum()),
        without_result=len(table) - len(found),
        nse=float(found[f"{prefix}nse"].mean()),
        nse_accepted=float(found.loc[found["accepted"], f"{prefix}nse"].mean()),
        nse_total=float(found[f"{prefix}nse_total"].mean()),
        ratios=np.sqrt(np.mean(errors**2, axis=0) / np.mean(sigmas**2, axis=0)),
        means=means_in_standard_errors(errors),
    )


def means_in_standard_errors(errors: Array) -> Array:
    """Return the means (6,) of errors (n, 6), each divided by its standard error s / √n."""
    return np.asarray(errors.mean(axis=0) / (errors.std(axis=0, ddof=1) / np.sqrt(len(errors))))


def markdown_row(name: str, statistics: Statistics) -> str:
    """Return a campaign's row of the table under ``HEAD``; bold is what chance does not explain."""
    low, high = statistics.band
    nse = f"{statistics.nse:.2f}" if statistics.in_band else f"**{statistics.nse:.2f}**"
    means = [
        f"**{mean:+.1f}**" if parameter in statistics.biased else f"{mean:+.1f}"
        for parameter, mean in zip(NAMES, statistics.means, strict=True)
    ]
    sessions = f"{statistics.sessions}"
    if statistics.without_result:
        sessions += f", {statistics.without_result} without a result"
    cells = [
        name,
        sessions,
        f"{statistics.accepted}",
        f"{nse} ({low:.2f}–{high:.2f})",
        f"{statistics.nse_accepted:.2f}",
        f"{statistics.nse_total:.2f}",
        ", ".join(f"{ratio:.2f}" for ratio in statistics.ratios),
        ", ".join(means),
    ]
    return f"| {' | '.join(cells)} |"
