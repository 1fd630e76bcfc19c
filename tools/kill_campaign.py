"""Kill runs at random times, run them again, and test that every Parquet file is that of an undisturbed run.

The program simulates a small session and calibrates it undisturbed. Then it starts one run after another, kills each by
SIGKILL after a random time and starts it again in the same folder. After that every Parquet file must have the bytes of
the undisturbed run. Every second run replaces an earlier complete result with another config; that result must still be
in the folder at the end. The seed fixes the times of the kills, but not which stage they interrupt. A run that ends
before its kill is not counted; the program goes on until it has killed the requested number of runs.

    python -m tools.kill_campaign [--kills 50] [--seed 1]
"""

import argparse
import hashlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml

POOLCAL = (sys.executable, "-m", "stages.cli")
ROOT = Path(__file__).parents[1]
SCENARIO = {
    "name": "kills",
    "track": {"distances_m": [4.0, 7.0], "half_length_m": 3.6},
    "laser": {"point_rate_hz": 2000.0, "line_rate_hz": 20.0},
    "mbes": {"ping_rate_hz": 8.0},
    "ins": {"rate_hz": 50.0},
}
DAMAGED = ".partial", ".old", ".new", ".keeping"  # names in use while a stage or a file is being replaced


@dataclass
class Campaign:
    """Counts of a campaign, and a line for each run whose files differ."""

    runs: int = 0
    kills: int = 0  # the other runs ended before their kill
    identical: int = 0
    different: list[str] = field(default_factory=list)
    killed_in: Counter[str] = field(default_factory=Counter)  # interrupted work that the kills left, by its name

    def __str__(self) -> str:
        where = ", ".join(f"{name} {count}" for name, count in self.killed_in.most_common())
        text = f"{self.runs} runs, {self.kills} killed mid-run, {self.identical} identical after running again"
        return "; ".join([f"{text} ({where})", *self.different])


def digests(run: Path) -> dict[str, str]:
    """Return the SHA-256 of every Parquet file, by its path in the run folder."""
    paths = sorted(run.rglob("*.parquet"))
    return {path.relative_to(run).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def command(session: Path, config: Path, run: Path) -> list[str]:
    """Return the command line that calibrates.

    Parameters
    ----------
    session
        Folder of the session.
    config
        The pool's config.
    run
        Folder of the run.
    """
    places = [str(session), "--config", str(config), "--run", str(run)]
    return [*POOLCAL, "run", *places, "--jobs", "2", "--no-report", "--no-recordings"]


def calibrate(session: Path, config: Path, run: Path) -> float:
    """Calibrate to the end and return the seconds.

    Parameters
    ----------
    session
        Folder of the session.
    config
        The pool's config.
    run
        Folder of the run.

    Raises
    ------
    SystemExit
        The run ended with neither status 0 nor 1.
    """
    start = time.monotonic()
    done = subprocess.run(command(session, config, run), cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{run}: status {done.returncode}\n{done.stderr}")
    return time.monotonic() - start


def campaign(session: Path, folder: Path, kills: int, seed: int) -> Campaign:
    """Kill runs, run them again, and return the counts.

    Parameters
    ----------
    session
        Folder of the session.
    folder
        Folder to work in.
    kills
        Number of runs to kill.
    seed
        Seed of the times of the kills.
    """
    config, other, rng, counts = session / "pool.yaml", folder / "other.yaml", np.random.default_rng(seed), Campaign()
    text = yaml.safe_load(config.read_text(encoding="utf-8")) | {"segment": {"margin_m": 0.05}}
    other.write_text(yaml.safe_dump(text), encoding="utf-8")
    seconds = [calibrate(session, config, folder / "undisturbed")] * 2  # duration: in a new folder, over a result
    right = digests(folder / "undisturbed")
    calibrate(session, other, folder / "earlier")
    earlier = (folder / "earlier" / "report" / "calibration.json").read_bytes()
    while counts.kills < kills:
        run, over = folder / f"run_{counts.runs}", counts.kills % 2
        if over:
            shutil.copytree(folder / "earlier", run)
        counts.runs += 1
        start = time.monotonic()
        if _killed(command(session, config, run), rng.uniform(0.0, seconds[over])):
            counts.kills += 1
            counts.killed_in[_state(run)] += 1
        else:
            seconds[over] = 0.5 * seconds[over] + 0.5 * (time.monotonic() - start)
        calibrate(session, config, run)
        after = digests(run)
        left = [path.name for path in run.rglob("*") if path.name.endswith(DAMAGED)]
        if after != right or left:
            wrong = sorted(name for name in right.keys() | after.keys() if right.get(name) != after.get(name))
            counts.different.append(f"run {counts.runs}: {', '.join(wrong + left)}")
        elif over and earlier not in [path.read_bytes() for path in run.glob("report*/calibration.json")]:
            left = ["the earlier accepted result is missing"]
            counts.different.append(f"run {counts.runs}: {left[0]}")
        counts.identical += after == right and not left
        shutil.rmtree(run)
    return counts


def _killed(words: Sequence[str], after_s: float) -> bool:
    """Kill a process and return whether it was still running then."""
    process = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(after_s)
    except subprocess.TimeoutExpired:
        process.kill()
    return process.wait() == -signal.SIGKILL


def _state(run: Path) -> str:
    """Return the interrupted work that a killed run left, in a word or two."""
    if not run.exists():
        return "before the folder"
    torn = sorted(path.name for path in run.rglob("*") if path.name.endswith(DAMAGED))
    return f"in {torn[0]}" if torn else "between"


def main() -> int:
    """Simulate a session, run the campaign, print its counts, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=50, help="number of runs to kill; default: 50")
    parser.add_argument("--seed", type=int, default=1, help="seed of the times of the kills; default: 1")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="poolcal-kills-") as name:
        folder = Path(name)
        (folder / "scenario.yaml").write_text(yaml.safe_dump(SCENARIO), encoding="utf-8")
        words = [*POOLCAL, "simulate", str(folder / "session"), "--scenario", str(folder / "scenario.yaml")]
        subprocess.run(words, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
        counts = campaign(folder / "session", folder, options.kills, options.seed)
    print(counts)
    return 0 if counts.identical == counts.runs else 1


if __name__ == "__main__":
    sys.exit(main())
