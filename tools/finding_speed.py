"""Measure how long finding a target takes beside bare decoding of the same session's files, and its memory.

Bare decoding is that of :mod:`tools.bench`. Both take turns, because other programs slow a machine down now and then.
The program prints the medians, and the median of the ratios of each turn.

    python -m tools.finding_speed SESSION [--repeats 3] [--jobs 2]
"""

import argparse
import statistics
import sys
from pathlib import Path

from tools.bench import DECODE, POOLCAL
from tools.measured import Spent, measured, memory_together


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("session", type=Path)
    parser.add_argument("--repeats", type=int, default=3, help="number of turns; default: 3")
    parser.add_argument("--jobs", type=int, default=2, help="number of workers; default: 2")
    options = parser.parse_args()
    decode = [sys.executable, "-c", DECODE, str(options.session)]
    find = [*POOLCAL, "target", str(options.session), "--jobs", str(options.jobs)]
    turns = [(measured(decode), measured(find)) for _ in range(options.repeats)]
    decoding, finding = zip(*turns, strict=True)
    print(f"{int(decoding[0].output) / 1e6:.1f} million laser points, medians of {options.repeats}\n")
    print("| | s | cpu s | peak MiB |", "|---|---:|---:|---:|", sep="\n")
    print(_row("bare decoding", decoding), _row("finding a target", finding), sep="\n")
    ratios = [(find.wall_s / decode.wall_s, find.cpu_s / decode.cpu_s) for decode, find in turns]
    wall, cpu = (statistics.median(one) for one in zip(*ratios, strict=True))
    print(f"| finding ÷ decoding | {wall:.2f} | {cpu:.2f} | |")
    print(f"\nmemory of all processes of finding together: {memory_together(find):.0f} MiB")


def _row(name: str, spent: tuple[Spent, ...]) -> str:
    wall_s, cpu_s, mib = (statistics.median(getattr(one, key) for one in spent) for key in ("wall_s", "cpu_s", "mib"))
    return f"| {name} | {wall_s:.2f} | {cpu_s:.2f} | {mib:.0f} |"


if __name__ == "__main__":
    main()
