"""Kill runs at random moments, run again, compare every byte: does a killed run leave anything that is trusted wrongly?

A small session is simulated and calibrated undisturbed. Then run after run is killed by SIGKILL at a random moment of
its duration (the moments follow from the seed; what they hit does not) and started again in the same folder, after
which every Parquet file must be that of the undisturbed run. Every other run is started over an earlier complete
result of another config, so that results are being replaced when the kill comes; that one must still be in the folder.
A run that ended before its kill does not count: it is tried again, until there are as many kills as were asked for.

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
DAMAGED = ".partial", ".old", ".new", ".keeping"  # what is under way when a stage or a file is being swapped in


@dataclass
class Campaign:
    """What came of it."""

    runs: int = 0
    kills: int = 0  # the other runs had ended before
    identical: int = 0
    different: list[str] = field(default_factory=list)
    killed_in: Counter[str] = field(default_factory=Counter)  # what the kill left under way

    def __str__(self) -> str:
        where = ", ".join(f"{name} {count}" for name, count in self.killed_in.most_common())
        text = f"{self.runs} runs, {self.kills} killed mid-run, {self.identical} identical after running again"
        return "; ".join([f"{text} ({where})", *self.different])


def digests(run: Path) -> dict[str, str]:
    """SHA-256 of every Parquet file, by its path in the run folder."""
    paths = sorted(run.rglob("*.parquet"))
    return {path.relative_to(run).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def command(session: Path, config: Path, run: Path) -> list[str]:
    places = [str(session), "--config", str(config), "--run", str(run)]
    return [*POOLCAL, "run", *places, "--jobs", "2", "--no-report", "--no-recordings"]


def calibrate(session: Path, config: Path, run: Path) -> float:
    """One run to its end; the seconds it took."""
    start = time.monotonic()
    done = subprocess.run(command(session, config, run), cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{run}: status {done.returncode}\n{done.stderr}")
    return time.monotonic() - start


def campaign(session: Path, folder: Path, kills: int, seed: int) -> Campaign:
    """``kills`` runs of ``session``, killed and run again; works in ``folder``."""
    config, other, rng, told = session / "pool.yaml", folder / "other.yaml", np.random.default_rng(seed), Campaign()
    text = yaml.safe_load(config.read_text(encoding="utf-8")) | {"segment": {"margin_m": 0.05}}
    other.write_text(yaml.safe_dump(text), encoding="utf-8")
    seconds = [calibrate(session, config, folder / "undisturbed")] * 2  # a run's duration: afresh, over a result
    right = digests(folder / "undisturbed")
    calibrate(session, other, folder / "earlier")
    earlier = (folder / "earlier" / "report" / "calibration.json").read_bytes()
    while told.kills < kills:
        run, over = folder / f"run_{told.runs}", told.kills % 2
        if over:
            shutil.copytree(folder / "earlier", run)
        told.runs += 1
        start = time.monotonic()
        if _killed(command(session, config, run), rng.uniform(0.0, seconds[over])):
            told.kills += 1
            told.killed_in[_state(run)] += 1
        else:
            seconds[over] = 0.5 * seconds[over] + 0.5 * (time.monotonic() - start)
        calibrate(session, config, run)
        found = digests(run)
        left = [path.name for path in run.rglob("*") if path.name.endswith(DAMAGED)]
        if found != right or left:
            wrong = sorted(name for name in right.keys() | found.keys() if right.get(name) != found.get(name))
            told.different.append(f"run {told.runs}: {', '.join(wrong + left)}")
        elif over and earlier not in [path.read_bytes() for path in run.glob("report*/calibration.json")]:
            left = ["the accepted result that was there is gone"]
            told.different.append(f"run {told.runs}: {left[0]}")
        told.identical += found == right and not left
        shutil.rmtree(run)
    return told


def _killed(words: Sequence[str], after_s: float) -> bool:
    """Whether the process was still at work when it was killed."""
    process = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(after_s)
    except subprocess.TimeoutExpired:
        process.kill()
    return process.wait() == -signal.SIGKILL


def _state(run: Path) -> str:
    """What a killed run left behind, in a word or two."""
    if not run.exists():
        return "before the folder"
    torn = sorted(path.name for path in run.rglob("*") if path.name.endswith(DAMAGED))
    return f"in {torn[0]}" if torn else "between"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="poolcal-kills-") as name:
        folder = Path(name)
        (folder / "scenario.yaml").write_text(yaml.safe_dump(SCENARIO), encoding="utf-8")
        words = [*POOLCAL, "simulate", str(folder / "session"), "--scenario", str(folder / "scenario.yaml")]
        subprocess.run(words, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
        told = campaign(folder / "session", folder, options.kills, options.seed)
    print(told)
    return 0 if told.identical == told.runs else 1


if __name__ == "__main__":
    sys.exit(main())
