"""A few kills of the campaign of tools/kill_campaign.py."""

from pathlib import Path

from tools.kill_campaign import campaign


def test_killed_and_run_again(small: Path, tmp_path: Path) -> None:
    told = campaign(small, tmp_path, kills=3, seed=7)
    assert told.kills == 3
    assert told.identical == told.runs, str(told)
