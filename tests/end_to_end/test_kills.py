"""Two kills, one of a first run and one over an earlier result: a few of the campaign of tools/kill_campaign.py."""

from pathlib import Path

from tools.kill_campaign import campaign


def test_killed_and_run_again(small: Path, tmp_path: Path) -> None:
    told = campaign(small, tmp_path, kills=2, seed=7)
    assert told.kills == 2
    assert told.identical == told.runs, str(told)
