"""``poolcal simulate``: a pool session with known truth, as instrument files."""

import sys
from pathlib import Path

from pipeline.atomic_files import writing
from pipeline.errors import ConfigError
from pipeline.language.speaking import say
from pipeline.simulation.session import simulate_to_folder


def command(out: Path, scenario: Path | None, seed: int) -> int:
    """Write a simulated session to a folder.

    Parameters
    ----------
    out
        The session's folder; the truth is written beside it.
    scenario
        A YAML file, or the name of one in configs/scenarios; None: the demo's pool.
    seed
        The seed of all random numbers.
    """
    if seed < 0:
        raise ConfigError(f"--seed {seed}: must not be negative")
    with writing(out):
        written = simulate_to_folder(out, scenario, seed)
    for name, value in written.items():
        say(f"{name}: {value:.1f}" if isinstance(value, float) else f"{name}: {value}", sys.stdout)
    return 0
