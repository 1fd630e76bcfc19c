"""The documents' table of accuracy judges drawn errors by total sigmas, and all others against the bound."""

import numpy as np
import pandas as pd

from tools.accuracy import Result, campaign_results, markdown
from tools.campaigns import CAMPAIGNS, path_of
from tools.session_rows import NAMES

DRAWN = next(campaign for campaign in CAMPAIGNS if campaign.name == "all errors drawn")
NOISE = next(campaign for campaign in CAMPAIGNS if campaign.name == "finite beams and INS drift")


def test_drawn_errors_are_judged_by_their_total_sigmas(tmp_path):
    columns = {"accepted": [True, False], "nse": [60.0, 80.0], "nse_total": [5.0, 6.0]}
    for name in NAMES:
        columns |= {f"error_{name}": [0.2, -0.2], f"sigma_{name}": [0.01] * 2, f"total_{name}": [0.1] * 2}
    pd.DataFrame(columns).to_parquet(tmp_path / path_of(DRAWN).name)
    text = markdown(campaign_results(tmp_path, bounds=1, jobs=1))
    assert "2 sessions, 1 accepted, mean NSE 5.50" in text
    assert "| RMS ÷ total sigma (95 % below) | 2.00 (" in text
    assert "| truth within the 95 % interval | 0.0 %" in text
    assert "bound" not in text


def test_noise_is_judged_against_the_bound():
    errors = np.tile([[0.2], [-0.2]], (1, 6))
    rows = Result(NOISE, errors, np.full((2, 6), 0.1), np.array([5.0, 6.0]), 2, np.full(6, 0.16)).rows()
    cells = {row[0]: row[1] for row in rows}
    assert cells["mean sigma"] == "0.1000"
    assert cells["Cramér–Rao bound"] == "0.1600"
    assert cells["RMS ÷ bound (95 % below)"].startswith("1.25 (")
