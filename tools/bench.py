"""Measure time and memory of whole runs on simulated sessions of three sizes, each four times the size before.

For each size the program prints:

* seconds and peak memory of each stage;
* the time of the whole run, compared with mere decoding of the same files (laspy, the INS and BTH0 readers, one after
  another in one process);
* time and memory of the whole run with report and recordings, the memory for all its processes together;
* georeferencing in million points a second;
* the accumulation of all labelled points into the adjustment's sums, by one process: observations a second and memory;
* the seconds of a second run, in which every stage is up to date.

All figures are medians. Machines differ and run other programs as well, so the ratios are more reliable than the times.

    python -m tools.bench [--sizes small medium large] [--repeats 3] [--jobs 2]
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path

import yaml

STAGES = ("ingest", "georeference", "segment", "fit_planes", "angle_iterate", "offsets", "adjust", "report")
FOLDER = Path("runs/bench")
POOLCAL = [sys.executable, "-m", "stages.cli"]

# The largest has more than 20 million laser points and two million soundings. Each smaller one has a quarter of the
# next larger: fewer and faster passes at the same rates of the instruments.
SIZES = {
    "small": {"distances_m": [4.0, 8.0], "speed_m_s": 0.68},
    "medium": {"distances_m": [4.0, 8.0, 5.0, 7.0], "speed_m_s": 0.34},
    "large": {"distances_m": [4.0, 8.0, 5.0, 7.0, 4.5, 6.0, 5.5, 7.5], "speed_m_s": 0.17},
}
INSTRUMENTS = {
    "laser": {"point_rate_hz": 120_000.0, "line_rate_hz": 120.0},
    "mbes": {"ping_rate_hz": 25.0},
}
DECODE = """
import sys, time
from pathlib import Path
import laspy
from pipeline.config.load import load_session
from pipeline.readers.dispatch import raw_parts
folder = Path(sys.argv[1]); session = load_session(folder)
start = time.perf_counter()
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
print(time.perf_counter() - start, points)
"""

ACCUMULATE = """
import resource, sys, time
from pathlib import Path
from pipeline.adjustment.accumulation import accumulate
from pipeline.adjustment.observation_model import CurrentValues
from pipeline.adjustment.ins_drift import drift_prior, pose_noise
from pipeline.adjustment.problem import SessionData, sonar_problem, surfaces_of_laser
from pipeline.artefacts.from_tables import trajectory_in_target
from pipeline.maths.adjustment.weighting import Weighting
from pipeline.artefacts.catalogue.points import POSES
from pipeline.artefacts.catalogue.target import LASER_LABELLED, PLANES, SOUNDINGS_LABELLED, TARGET_POSE
from pipeline.mount import mount_of
from pipeline.run.results import Tables
from pipeline.run.settings import read_settings
from pipeline.target.design import target_of
run = Path(sys.argv[1]); tables, settings = Tables(run), read_settings(run)
pool, session = settings.pool, settings.session
target, laser, mbes = target_of(pool.target), session.laser, session.mbes
data = SessionData(
    target=target, surfaces=surfaces_of_laser(target, tables.table(PLANES)),
    trajectory=trajectory_in_target(tables.table(POSES), tables.table(TARGET_POSE)),
    laser_lever_arm_m=mount_of(laser.mount).lever_arm_body_m,
    noise=pose_noise(session.ins.drift, session.ins.white), drift=drift_prior(session.ins.drift_within),
    as_built=pool.as_built,
)
model = sonar_problem(data, mount_of(mbes.mount), {"laser": laser, "mbes": mbes}).model
streams = {"laser": tables.stream(LASER_LABELLED), "mbes": tables.stream(SOUNDINGS_LABELLED)}
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
start = time.perf_counter()
accumulation = accumulate(streams, model, CurrentValues(model.coarse, None, Weighting(robust=(3.0, 6.0))))
spent = time.perf_counter() - start
after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(spent, sum(group.count for group in accumulation.groups.values()), (after - before) / 1024)
"""


def measured(command: list[str]) -> tuple[float, float, str]:
    """Return seconds and peak MiB of a command, and its output."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    output = process.stdout.read() if process.stdout else ""
    _, status, usage = os.wait4(process.pid, 0)
    if os.waitstatus_to_exitcode(status) not in (0, 1):
        raise RuntimeError(f"{' '.join(command)} ended with {os.waitstatus_to_exitcode(status)}")
    return time.perf_counter() - start, usage.ru_maxrss / 1024, output


def memory_together(command: list[str]) -> float:
    """Return the peak MiB of a command and its child processes together.

    A memory page that several processes share is counted once. The sampling takes time of its own, so this is no
    measurement of seconds.
    """
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    peak = 0.0
    while process.poll() is None:
        peak = max(peak, sum(_share_mib(pid) for pid in _family(process.pid)))
        time.sleep(0.05)
    return peak


def _family(pid: int) -> list[int]:
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    except OSError:
        return [pid]
    return [pid, *(descendant for child in children for descendant in _family(int(child)))]


def _share_mib(pid: int) -> float:
    try:
        status = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="utf-8")
    except OSError:
        return 0.0
    return sum(int(line.split()[1]) / 1024 for line in status.splitlines() if line.startswith("Pss:"))


def session_of(size: str) -> Path:
    """Return the folder of a simulated session; simulate it if there is none."""
    folder = FOLDER / f"session-{size}"
    if not folder.exists():
        FOLDER.mkdir(parents=True, exist_ok=True)
        scenario = FOLDER / f"{size}.yaml"
        scenario.write_text(yaml.safe_dump({"name": size, "track": SIZES[size], **INSTRUMENTS}))
        command = [*POOLCAL, "simulate", str(folder), "--scenario", str(scenario)]
        subprocess.run(command, check=True, capture_output=True)
    return folder


def bench(size: str, repeats: int, jobs: int) -> dict[str, float]:
    """Measure one size and return the medians over the repeats, by name.

    Parameters
    ----------
    size
        A key of SIZES.
    repeats
        Number of measurements.
    jobs
        Number of worker processes.
    """
    session = session_of(size)
    run = FOLDER / f"run-{size}"
    rounds: list[dict[str, float]] = []
    for _ in range(repeats):
        shutil.rmtree(run, ignore_errors=True)
        figures: dict[str, float] = {}
        _, _, text = measured([sys.executable, "-c", DECODE, str(session)])
        figures["decode_s"], figures["points"] = (float(word) for word in text.split())
        workers = ["--jobs", str(jobs)]
        common = [*workers, "--no-report", "--no-recordings"]
        whole = [*POOLCAL, "run", str(session), "--config", str(session / "pool.yaml"), "--run", str(run)]
        figures["drawn_mib"] = memory_together([*whole, *workers])
        shutil.rmtree(run)
        figures["drawn_s"], _, _ = measured([*whole, *workers])
        shutil.rmtree(run)
        figures["run_s"], figures["run_mib"], _ = measured([*whole, *common])
        figures["drawing_share"] = figures["drawn_s"] / figures["run_s"] - 1
        figures["again_s"], _, _ = measured([*whole, *common])
        _, _, text = measured([sys.executable, "-c", ACCUMULATE, str(run)])
        seconds, figures["observations"], figures["reading_mib"] = (float(word) for word in text.split())
        figures["reading_rate"] = figures["observations"] / seconds
        for stage in STAGES:
            figures[f"{stage}_s"] = json.loads((run / stage / "manifest.json").read_text())["wall_s"]
            shutil.rmtree(run / stage)
            _, figures[f"{stage}_mib"], _ = measured([*POOLCAL, "stage", stage, str(run), *common])
        rounds.append(figures)
    return {name: statistics.median(figures[name] for figures in rounds) for name in rounds[0]}


def table(results: dict[str, dict[str, float]]) -> str:
    """Return the figures of each size as a Markdown table."""
    lines = ["| | " + " | ".join(results) + " |", "|---|" + "---:|" * len(results)]

    def row(name: str, cells: list[str]) -> None:
        lines.append(f"| {name} | " + " | ".join(cells) + " |")

    values = list(results.values())
    row("laser points, million", [f"{v['points'] / 1e6:.1f}" for v in values])
    for stage in STAGES:
        row(f"{stage}: s, peak MiB", [f"{v[f'{stage}_s']:.1f}, {v[f'{stage}_mib']:.0f}" for v in values])
    row("whole run: s, peak MiB", [f"{v['run_s']:.1f}, {v['run_mib']:.0f}" for v in values])
    row("with report and recordings: s, peak MiB", [f"{v['drawn_s']:.1f}, {v['drawn_mib']:.0f}" for v in values])
    row("drawing adds", [f"{100 * v['drawing_share']:.0f} %" for v in values])
    row("bare decoding, s", [f"{v['decode_s']:.1f}" for v in values])
    row("whole run ÷ bare decoding", [f"{v['run_s'] / v['decode_s']:.2f}" for v in values])
    row("georeferencing, million points a second", [f"{v['points'] / v['georeference_s'] / 1e6:.1f}" for v in values])
    row("observations on the target, million", [f"{v['observations'] / 1e6:.2f}" for v in values])
    row("accumulating them, one process: million a second", [f"{v['reading_rate'] / 1e6:.1f}" for v in values])
    row("the same: memory it adds, MiB", [f"{v['reading_mib']:.0f}" for v in values])
    row("second run, nothing to do, s", [f"{v['again_s']:.1f}" for v in values])
    return "\n".join(lines)


def main() -> None:
    """Measure the chosen sizes and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--sizes", nargs="*", default=list(SIZES), choices=list(SIZES), metavar="SIZE",
        help=f"sizes of session: {', '.join(SIZES)}; default: all",
    )  # fmt: skip
    parser.add_argument("--repeats", type=int, default=3, help="number of measurements of each size; default: 3")
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    options = parser.parse_args()
    results = {size: bench(size, options.repeats, options.jobs) for size in options.sizes}
    print(f"{options.jobs} workers, {os.cpu_count()} cores, medians of {options.repeats}\n")
    print(table(results))


if __name__ == "__main__":
    main()
