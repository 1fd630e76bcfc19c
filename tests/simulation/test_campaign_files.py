"""Rows of a campaign: an interruption loses none, and they are the same for any number of workers."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tools.campaign_files import collect_rows

Task = tuple[int, Path]


def row_of(task: Task) -> dict[str, Any]:
    """A row with what CSV does not keep: a float's last digit, text without letters, a number that is none."""
    number, stopper = task
    if stopper.is_file() and number == int(stopper.read_text()):
        raise InterruptedError(number)
    values = np.random.default_rng(number).normal(size=2)
    nothing = np.nan if number % 2 else 1.0
    return {"number": number, "value": values[0], "third": float(values[1]) / 3, "text": "", "nothing": nothing}


def collected(folder: Path, count: int, jobs: int, resume: bool) -> pd.DataFrame:
    tasks = [(number, folder / "stop") for number in range(count)]
    return collect_rows(folder / "rows.parquet", row_of, tasks, jobs, resume, tasks_of_a_worker=10)


def test_an_interrupted_campaign_goes_on_where_it_stopped(tmp_path: Path) -> None:
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    whole.mkdir()
    broken.mkdir()
    collected(whole, 5, jobs=2, resume=False)
    (broken / "stop").write_text("3")
    with pytest.raises(InterruptedError):
        collected(broken, 5, jobs=1, resume=True)
    lines = broken / "rows.jsonl"
    assert len(lines.read_text().splitlines()) == 3
    assert not (broken / "rows.parquet").exists()
    lines.write_text(lines.read_text() + '{"number": 3, "val')  # killed while writing
    (broken / "stop").write_text("0")  # which is not computed again
    table = collected(broken, 5, jobs=1, resume=True)
    assert (broken / "rows.parquet").read_bytes() == (whole / "rows.parquet").read_bytes()
    assert table["number"].tolist() == [0, 1, 2, 3, 4]
    assert table["text"].tolist() == [""] * 5
    assert table["third"].tolist() == [row_of((k, tmp_path / "none"))["third"] for k in range(5)]


def test_without_resume_a_campaign_begins_anew_and_a_finished_one_is_read(tmp_path: Path) -> None:
    lines = tmp_path / "rows.jsonl"
    lines.write_text('{"number": 7}\n{"number": 8}\n{"number": 9}\n')
    assert collected(tmp_path, 2, jobs=1, resume=True)["number"].tolist() == [7, 8]  # nothing is left to compute
    assert len(lines.read_text().splitlines()) == 3
    assert collected(tmp_path, 2, jobs=1, resume=False)["number"].tolist() == [0, 1]
