"""Write the table of the campaigns whose noise is not what the settings say, and of the laser's own calibration.

The program reads the rows that ``tools.montecarlo`` (``tools.stress_campaigns``) and ``tools.laser`` have written, and
prints a line for each campaign that has rows. Bold is a mean normalised squared error (NSE) outside the band in which
it lies with 99 % probability, and a mean error beyond 2.6 of its standard errors.

    python -m tools.montecarlo --only "slant noise" drift steering perfect --resume
    python -m tools.laser --sessions 100 --resume
    python -m tools.laser --sessions 100 --drift "within 10 s" --resume
    python -m tools.stress [runs/montecarlo | docs/accuracy] [--page docs/accuracy/stress.md]
"""

import argparse
from pathlib import Path

import pandas as pd

from tools.campaign_statistics import HEAD, markdown_row, statistics_of
from tools.campaigns import FOLDER, path_of
from tools.laser import FAST, rows_of
from tools.session_rows import NAMES
from tools.stress_campaigns import STRESS

WORDS = "the laser's own calibration"
PAGE_HEAD = """# Campaigns under noise that the settings do not describe

NSE: normalised squared error of the six mount parameters by their random covariance (of the laser: by the total one,
with the coarse mount), 6 on average if it is true; in brackets the band of its mean with 99 % probability. σ: the
sigma by the same covariance. No systematic errors are simulated, so that the NSE by total sigmas is smaller.
docs/theory/accuracy.md says what each campaign simulates.
"""


def table_of(folder: Path) -> str:
    """Return the table, in Markdown, of the campaigns that have rows in the folder."""
    sources = [(campaign.name, folder / path_of(campaign).name, "") for campaign in STRESS]
    for drift in ("", *FAST):
        sources.append((f"{WORDS}{drift and f', drift {drift}'}", folder / rows_of(drift).name, "laser_"))
    lines = [HEAD, "|---" + "|---:" * (HEAD.count("|") - 2) + "|"]
    for name, path, prefix in sources:
        if path.is_file():
            table = pd.read_parquet(path)
            if prefix:  # the error of the coarse mount is in the total sigmas alone
                totals = {f"{prefix}sigma_{axis}": table[f"{prefix}total_{axis}"] for axis in NAMES}
                table = table.assign(**totals, **{f"{prefix}nse": table[f"{prefix}nse_total"]})
            lines.append(markdown_row(name, statistics_of(table, prefix)))
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the table, or write it into a file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=FOLDER, help=f"folder of the rows; default: {FOLDER}")
    parser.add_argument("--page", type=Path, help="file that the table is written to; default: none, it is printed")
    options = parser.parse_args()
    text = table_of(options.folder)
    if options.page is None:
        print(text, end="")
    else:
        options.page.write_text(f"{PAGE_HEAD}\n{text}", encoding="utf-8")


if __name__ == "__main__":
    main()
