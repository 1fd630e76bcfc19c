"""A kill of a first run, and one over an earlier result: a few of the campaign of tools/kill_campaign.py."""

from pathlib import Path

import pytest

from tools.kill_campaign import campaign

KILLS = 2


@pytest.mark.thorough
def test_killed_and_run_again(small: Path, tmp_path: Path) -> None:
    told = campaign(small, tmp_path, kills=KILLS, seed=7)
    assert told.kills == KILLS
    assert told.identical == told.runs, str(told)
