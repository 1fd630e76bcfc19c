"""Measure time and memory of whole runs on simulated sessions of several sizes, each four times the size before.

For each size the program prints, as medians:

* seconds, processor seconds and peak memory of mere decoding of the same files (laspy, the INS and BTH0 readers, one
  after another in one process), and of the whole run without and with report and recordings, with their ratios;
* seconds and processor seconds of each stage, and the peak memory of the process up to its end;
* the seconds of a second run, in which every stage is up to date, and of the same libraries' import.

Then follow the growth of the time with the number of points, and the rates of the compiled loops
(:mod:`tools.bench_kernels`). Machines differ and run other programs as well: rounds of different sizes take turns, and
ratios are more reliable than times.

    python -m tools.bench [--sizes small medium large huge long] [--repeats 5] [--jobs 2]
"""

import argparse
import math
import os
import shutil
import statistics
import subprocess
import sys
from itertools import combinations
from pathlib import Path

import yaml

from tools.bench_kernels import kernels
from tools.measured import Spent, measured, memory_together

STAGES = ("ingest", "georeference", "segment", "fit_planes", "angle_iterate", "offsets", "adjust", "report")
FOLDER = Path("runs/bench")
POOLCAL = [sys.executable, "-m", "stages.cli"]

# The third has more than 20 million laser points and two million soundings. Each smaller one has a quarter of the next
# larger: fewer and faster passes at the same rates of the instruments. Two have four times its points: one by faster
# instruments, one by more passes, which last half an hour.
PASSES_M = [4.0, 8.0, 5.0, 7.0, 4.5, 6.0, 5.5, 7.5]
SLOW = {
    "laser": {"point_rate_hz": 120_000.0, "line_rate_hz": 120.0},
    "mbes": {"ping_rate_hz": 25.0},
}
FAST = {
    "laser": {"point_rate_hz": 480_000.0, "line_rate_hz": 240.0},
    "mbes": {"ping_rate_hz": 100.0},
}
SIZES: dict[str, dict[str, object]] = {
    "small": {"track": {"distances_m": PASSES_M[:2], "speed_m_s": 0.68}, **SLOW},
    "medium": {"track": {"distances_m": PASSES_M[:4], "speed_m_s": 0.34}, **SLOW},
    "large": {"track": {"distances_m": PASSES_M, "speed_m_s": 0.17}, **SLOW},
    "huge": {"track": {"distances_m": PASSES_M, "speed_m_s": 0.17}, **FAST},
    "long": {"track": {"distances_m": 4 * PASSES_M, "speed_m_s": 0.17}, **SLOW},
}
DECODE = """
import sys
from pathlib import Path
import laspy
from pipeline.config.load import load_session
from pipeline.readers.dispatch import raw_parts
folder = Path(sys.argv[1]); session = load_session(folder)
points = 0
for path in sorted((folder / "laser").iterdir()):
    with laspy.open(path) as file:
        for chunk in file.chunk_iterator(1_000_000):
            x, y, z, t = chunk.x.scaled_array(), chunk.y.scaled_array(), chunk.z.scaled_array(), chunk.gps_time
            points += len(x)
for sensor, settings in (("ins", session.ins), ("mbes", session.mbes)):
    for part in raw_parts(sensor, settings, folder):
        for chunk in part.chunks():
            pass
print(points)
"""
IMPORT = """
import gc; gc.set_threshold(50_000)
import lazrs, numba, novatel_edie, numpy, open3d, pandas, pyarrow.parquet, pydantic, pyproj, scipy.linalg, typer, yaml
import scipy.optimize, scipy.special
"""
STAGED = """
import resource, sys, time
from pathlib import Path
from stages.commands.entry import prepare_process
prepare_process()
from pipeline.run import runner
from pipeline.run.workers import workers
from stages import load
def now():
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return time.perf_counter(), sum(u.ru_utime + u.ru_stime for u in usages), usages[0].ru_maxrss / 1024
session, run, jobs = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
modules = load()
with workers(jobs, None) as pool:
    last = now()
    def tell(stage):
        global last
        this = now()
        print(stage, this[0] - last[0], this[1] - last[1], this[2])
        last = this
    runner.run(modules, session, session / "pool.yaml", run, workers=pool, finished=tell)
"""


def session_of(size: str) -> Path:
    """Return the folder of a simulated session; simulate it if there is none."""
    folder = FOLDER / f"session-{size}"
    if not folder.exists():
        FOLDER.mkdir(parents=True, exist_ok=True)
        scenario = FOLDER / f"{size}.yaml"
        scenario.write_text(yaml.safe_dump({"name": size, **SIZES[size]}))
        command = [*POOLCAL, "simulate", str(folder), "--scenario", str(scenario)]
        subprocess.run(command, check=True, capture_output=True)
    return folder


def once(size: str, jobs: int) -> dict[str, float]:
    """Return one measurement of each figure of a size, by name.

    Parameters
    ----------
    size
        A key of SIZES.
    jobs
        Number of workers.
    """
    session, run = session_of(size), FOLDER / f"run-{size}"
    whole = [*POOLCAL, "run", str(session), "--config", str(session / "pool.yaml"), "--run", str(run)]
    whole += ["--jobs", str(jobs)]
    plain = [*whole, "--no-report", "--no-recordings"]
    figures: dict[str, float] = {}

    def note(name: str, command: list[str], afresh: bool = False) -> Spent:
        if afresh:
            shutil.rmtree(run, ignore_errors=True)
        spent = measured(command)
        figures[f"{name}: s"], figures[f"{name}: cpu"], figures[f"{name}: MiB"] = spent.wall_s, spent.cpu_s, spent.mib
        return spent

    figures["points"] = float(note("decode", [sys.executable, "-c", DECODE, str(session)]).output)
    note("run", plain, afresh=True)
    note("again", plain)
    note("drawn", whole, afresh=True)
    shutil.rmtree(run)
    figures["together: MiB"] = memory_together(whole)
    note("nothing", [sys.executable, "-c", "pass"])
    note("help", [*POOLCAL, "--help"])
    note("import", [sys.executable, "-c", IMPORT])
    staged = note("staged", [sys.executable, "-c", STAGED, str(session), str(run), str(jobs)], afresh=True)
    for line in staged.output.splitlines():
        stage, *words = line.split()
        for unit, word in zip(("s", "cpu", "MiB"), words, strict=True):
            figures[f"{stage}: {unit}"] = float(word)
    return figures


def table(results: dict[str, dict[str, float]]) -> str:
    """Return the figures of each size as a Markdown table."""
    lines = ["| | " + " | ".join(results) + " |", "|---|" + "---:|" * len(results)]
    values = list(results.values())

    def row(name: str, cells: list[str]) -> None:
        lines.append(f"| {name} | " + " | ".join(cells) + " |")

    def ratio(name: str, to: str, unit: str) -> list[str]:
        return [f"{v[f'{name}: {unit}'] / v[f'{to}: {unit}']:.2f}" for v in values]

    def all_three(name: str) -> list[str]:
        return [f"{v[f'{name}: s']:.2f}, {v[f'{name}: cpu']:.2f}, {v[f'{name}: MiB']:.0f}" for v in values]

    row("laser points, million", [f"{v['points'] / 1e6:.1f}" for v in values])
    for stage in STAGES:
        row(f"{stage}: s, cpu s, peak MiB so far", all_three(stage))
    row("**whole run**: s, cpu s, peak MiB", all_three("run"))
    row("with report and recordings", all_three("drawn"))
    row("memory of all its processes together, MiB", [f"{v['together: MiB']:.0f}" for v in values])
    row("bare decoding: s, cpu s, peak MiB", all_three("decode"))
    row("**whole run ÷ bare decoding**: s", ratio("run", "decode", "s"))
    row("the same: cpu s", ratio("run", "decode", "cpu"))
    row("with report and recordings ÷ bare decoding: s", ratio("drawn", "decode", "s"))
    row("import of the same libraries, s", [f"{v['import: s']:.2f}" for v in values])
    row("whole run ÷ their import", ratio("run", "import", "s"))
    row("second run, nothing to do, s", [f"{v['again: s']:.2f}" for v in values])
    row("the same ÷ `python -c pass`", ratio("again", "nothing", "s"))
    row("`poolcal --help`, s", [f"{v['help: s']:.2f}" for v in values])
    row("the same ÷ `python -c pass`", ratio("help", "nothing", "s"))
    return "\n".join(lines)


def growth(results: dict[str, dict[str, float]]) -> str:
    """Return by which power of the number of points the time of the whole run grows, from size to size."""
    lines = []
    for (small, a), (large, b) in combinations(results.items(), 2):
        if b["points"] < 2 * a["points"]:
            continue
        power = math.log(b["run: s"] / a["run: s"]) / math.log(b["points"] / a["points"])
        lines.append(f"{small} to {large}: time grows as points to the power {power:.2f}")
    return "\n".join(lines)


def main() -> None:
    """Measure the chosen sizes and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--sizes", nargs="*", default=list(SIZES), choices=list(SIZES), metavar="SIZE",
        help=f"sizes of session: {', '.join(SIZES)}; default: all",
    )  # fmt: skip
    parser.add_argument("--repeats", type=int, default=5, help="number of measurements of each size; default: 5")
    parser.add_argument("--jobs", type=int, default=2, help="number of workers; default: 2")
    options = parser.parse_args()
    rounds: dict[str, list[dict[str, float]]] = {size: [] for size in options.sizes}
    for _ in range(options.repeats):
        for size, of_size in rounds.items():
            of_size.append(once(size, options.jobs))
    results = {
        size: {name: statistics.median(figures[name] for figures in of_size) for name in of_size[0]}
        for size, of_size in rounds.items()
    }
    print(f"{options.jobs} workers, {os.cpu_count()} cores, medians of {options.repeats}\n")
    print(table(results), growth(results), kernels(FOLDER / f"run-{options.sizes[-1]}"), sep="\n\n")


if __name__ == "__main__":
    main()
