"""poolcal with toy stages, run as a command of its own."""

import subprocess
import sys

from tests.support.roots import ROOT
from tests.support.toy_run import Pool

TOY = [sys.executable, str(ROOT / "tests" / "support" / "toy_poolcal.py")]


def toy_poolcal(*words: object, env: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    command = [*TOY, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, env=env, check=False)


def run_words(pool: Pool) -> tuple[object, ...]:
    """The words of ``poolcal run`` for a session of toy files."""
    return ("run", pool.session, "--config", pool.config, "--run", pool.run_folder)


def set_outcome(pool: Pool, code: int) -> None:
    """What the toy report does, by the codes of toy_poolcal.py."""
    pool.margin(0.05)
    pool.config.write_text(pool.config.read_text() + f"verdict: {{max_sigma_m: {code}}}\n")
