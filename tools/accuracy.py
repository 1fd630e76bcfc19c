"""Compare the errors of the campaigns with the Cramér-Rao bound, in a table and on a page with plots.

The program reads the rows that ``tools.montecarlo`` and ``tools.mistakes`` have written, and computes the Cramér-Rao
bound for each kind of noise (``tools.bound``). A campaign whose systematic errors are drawn is judged by its total
sigmas, and has no bound. The program prints the table of docs/theory/accuracy.md and writes
runs/montecarlo/accuracy.html.

    python -m tools.accuracy [runs/montecarlo | docs/accuracy] [--bounds 24] [--jobs 2]
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import jinja2
import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from pipeline.config.yaml_models import parse
from pipeline.results.pages.rendering import drawing_style, picture
from pipeline.simulation.scenario import Scenario
from tools.bound import bound
from tools.campaign_files import processes
from tools.campaign_statistics import means_in_standard_errors, nse_band
from tools.campaigns import CAMPAIGNS, FOLDER, Campaign, path_of, scenario_of
from tools.session_rows import NAMES, UNITS

Array = NDArray[np.float64]
NAMED = ("finite beams, outliers", "finite beams and INS", "twelve passes", "all errors")
LEVEL = 0.95
PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>poolcal: accuracy</title>
<style>body{font:16px/1.5 system-ui,sans-serif;max-width:68rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse}td,th{padding:.2rem .7rem;text-align:right;border-bottom:1px solid #ddd}
td:first-child,th:first-child{text-align:left}img{max-width:100%;height:auto}</style>
<h1>Accuracy on simulated sessions</h1>
{% for result in results %}<h2>{{ result.rows()[0][0].replace("**", "") }}</h2>
<table><tr><th></th>{% for name in names %}<th>{{ name }} {{ "°" if loop.index0 < 3 else "mm" }}</th>{% endfor %}</tr>
{% for row in result.rows()[1:] %}<tr>{% for cell in row %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}</table>{{ plots(result) }}{% endfor %}
{% if mistakes is not none %}<h2>Effects of mistakes: {{ mistakes | length }} sessions</h2>{{ mistakes_plot(mistakes) }}
{% endif %}</html>
"""


@dataclass(frozen=True)
class Result:
    """The errors of a campaign's sessions against their sigmas and the Cramér-Rao bound.

    Attributes
    ----------
    campaign
        The campaign.
    errors, sigmas
        (n, 6): errors of the mount parameters and their sigmas, in degrees and millimetres: random sigmas, or total
        ones where the campaign's systematic errors are drawn.
    nse
        (n,): normalised squared errors by the covariance of these sigmas.
    accepted
        Number of accepted sessions.
    bound
        (6,): sigmas of the bound, in degrees and millimetres; None: there is none for total sigmas.
    """

    campaign: Campaign
    errors: Array
    sigmas: Array
    nse: Array
    accepted: int
    bound: Array | None

    @property
    def count(self) -> int:
        """Number of sessions."""
        return len(self.errors)

    @property
    def rms(self) -> Array:
        """RMS errors (6,) in degrees and millimetres."""
        return np.asarray(np.sqrt(np.mean(self.errors**2, axis=0)))

    @property
    def below(self) -> float:
        """Upper confidence limit of RMS ÷ σ, per its value: n RMS² / σ² is chi-squared with n degrees of freedom."""
        return float(np.sqrt(self.count / chi2.ppf(1 - LEVEL, self.count)))

    @property
    def covered(self) -> Array:
        """Share of sessions (6,) whose 95 % interval contains the true value."""
        return np.asarray(np.mean(np.abs(self.errors) <= norm.ppf(0.975) * self.sigmas, axis=0))

    @property
    def band(self) -> tuple[float, float]:
        """99 % band of the mean normalised squared error."""
        return nse_band(self.count)

    def rows(self) -> list[list[str]]:
        """Return the rows of the table: a heading, then rows with a value for each mount parameter."""
        figures = [4, 4, 4, 3, 3, 3]

        def line(name: str, values: Array, sign: str = "") -> list[str]:
            return [name, *(f"{value:{sign}.{digits}f}" for value, digits in zip(values, figures, strict=True))]

        low, high = self.band
        head = f"**{self.campaign.name}**: {self.count} sessions, {self.accepted} accepted, mean NSE "
        head += f"{self.nse.mean():.2f} ({low:.2f}–{high:.2f})"
        sigma = np.sqrt(np.mean(self.sigmas**2, axis=0))
        name, reference = ("total sigma", sigma) if self.bound is None else ("bound", self.bound)
        ratio = self.rms / reference
        return [
            [head, *[""] * len(NAMES)],
            line("mean error", np.mean(self.errors, axis=0), "+"),
            ["the same ÷ its standard error", *(f"{value:+.1f}" for value in means_in_standard_errors(self.errors))],
            line("RMS error", self.rms),
            line("total sigma" if self.bound is None else "mean sigma", sigma),
            *([] if self.bound is None else [line("Cramér–Rao bound", self.bound)]),
            [f"RMS ÷ {name} (95 % below)", *(f"{value:.2f} ({value * self.below:.2f})" for value in ratio)],
            ["truth within the 95 % interval", *(f"{100 * value:.1f} %" for value in self.covered)],
        ]


def campaign_results(folder: Path, bounds: int, jobs: int) -> list[Result]:
    """Return a result for each named campaign with rows in the folder; its bound is the mean over some sessions."""
    results = []
    with processes(jobs) as pool:
        for campaign in CAMPAIGNS:
            path = folder / path_of(campaign).name
            if not campaign.name.startswith(NAMED) or not path.is_file():
                continue
            table = pd.read_parquet(path)
            kind, squared = campaign.judged_by
            errors, sigmas = (table[[f"{word}_{name}" for name in NAMES]].to_numpy() for word in ("error", kind))
            bound_sigmas = None
            if not campaign.drawn:
                tasks = [(campaign, number) for number in range(min(bounds, len(table)))]
                bound_sigmas = np.sqrt(np.diag(np.mean(pool.starmap(_bound, tasks), axis=0))) / UNITS
            accepted = int(table["accepted"].sum())
            results.append(Result(campaign, errors, sigmas, table[squared].to_numpy(), accepted, bound_sigmas))
    return results


def _bound(campaign: Campaign, number: int) -> Array:
    scenario = parse(Scenario, scenario_of(campaign, number), campaign.name)
    return bound(scenario, campaign.first_seed + number)


def markdown(results: list[Result]) -> str:
    """Return the table of docs/theory/accuracy.md."""
    lines = ["| | pitch ° | roll ° | yaw ° | x mm | y mm | z mm |", "|---|---:|---:|---:|---:|---:|---:|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for result in results for row in result.rows()])


def plots(result: Result) -> Markup:
    """Plot the normalised errors against the normal distribution, and the NSE against chi-squared."""
    figure = Figure(figsize=(15, 2.4), layout="constrained")
    axes = figure.subplots(1, 7)
    x = np.linspace(-4, 4, 161)
    normalised = result.errors / result.sigmas
    for k, name in enumerate(NAMES):
        axes[k].hist(normalised[:, k], bins=np.arange(-4, 4.1, 0.5), density=True, color="#8fb8de")
        axes[k].plot(x, norm.pdf(x), color="#333")
        axes[k].set(title=name, xlabel="error ÷ sigma", yticks=[])
    squares = np.linspace(0, 30, 151)
    axes[6].hist(np.minimum(result.nse, 30), bins=np.arange(0, 31, 2), density=True, color="#e3b778")
    axes[6].plot(squares, chi2.pdf(squares, 6), color="#333")
    axes[6].set(title="all parameters", xlabel="normalised squared error", yticks=[])
    return picture(figure, "errors in sigmas against their expected distributions")


def mistakes_plot(table: pd.DataFrame) -> Markup:
    """Plot the largest error of each session in total sigmas, by mistake and by verdict."""
    names = list(dict.fromkeys(table["mistake"]))
    figure = Figure(figsize=(11, 0.28 * len(names) + 1), layout="constrained")
    axis = figure.subplots()
    for accepted, colour, word in ((False, "#b8b8b8", "rejected"), (True, "#1f6fb2", "accepted")):
        rows = table[(table["accepted"] == accepted) & table["sigmas"].notna()]
        spread = 0.15 * np.sin(np.arange(len(rows)))
        height = rows["mistake"].map(names.index).to_numpy(dtype=float) + spread
        axis.scatter(np.clip(rows["sigmas"], 0.05, 100), height, s=9, color=colour, label=word)
    axis.axvline(5, color="#c33", linewidth=1)
    axis.set(xscale="log", xlabel="largest error of the mount parameters, in total sigmas", yticks=range(len(names)))
    axis.set_yticklabels(names)
    axis.invert_yaxis()
    axis.legend(loc="lower right")
    return picture(figure, "largest error of each session in total sigmas, by mistake")


def page(results: list[Result], mistakes: pd.DataFrame | None) -> str:
    """Return the HTML page: tables and plots of the campaigns, then the mistakes."""
    template = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined).from_string(PAGE)
    with drawing_style():
        return template.render(
            results=results, mistakes=mistakes, names=NAMES, plots=plots, mistakes_plot=mistakes_plot
        )


def main() -> None:
    """Print the table and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=FOLDER, help=f"folder of the rows; default: {FOLDER}")
    parser.add_argument("--bounds", type=int, default=24, help="number of sessions over which the bound is averaged")
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    options = parser.parse_args()
    results = campaign_results(options.folder, options.bounds, options.jobs)
    path = options.folder / "mistakes.parquet"
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / "accuracy.html").write_text(page(results, pd.read_parquet(path) if path.is_file() else None), "utf-8")
    print(markdown(results))


if __name__ == "__main__":
    main()
