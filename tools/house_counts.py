"""Measure how easy a checkout is to read: three counts, and the sizes of its modules and functions.

1. Public classes and functions of ``pipeline/`` and ``stages/`` whose name is defined in more than one module. Names
   that a protocol prescribes (PROTOCOLS) are left out.
2. Files that a reader enters to follow stage adjust. The program calibrates a small simulated session and lists each
   function of the project once, in the order of first calls during ``stages.adjust.run``. An entry is a function in
   another file than the function before it. A file flat in ``pipeline/`` has no folder whose name explains it.
3. Calls with six or more positional arguments, where two values are easily exchanged.

    python -m tools.house_counts [CHECKOUT] [--list]

CHECKOUT is the worktree of another commit, for instance of the commit before a change; default: this one. ``--list``
also prints every item that is counted.
"""

import argparse
import ast
import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("pipeline", "stages")
PROTOCOLS = {
    "Config": "a stage", "Inputs": "a stage", "Outputs": "a stage", "run": "a stage", "prepare": "a stage over streams",
    "run_batch": "a stage over streams", "combine": "a stage over streams", "log": "a view of a stage",
    "command": "a command", "main": "a program",
}  # fmt: skip
MANY_ARGUMENTS = 6
TRACE = """
import json, sys
from pathlib import Path
import stages.adjust
from stages.cli import call
source, session, run, result = sys.argv[1:]
folders, order, wanted = tuple(f"{source}/{name}/" for name in ("pipeline", "stages")), {}, {}
def follow(frame, event, _):
    code = frame.f_code
    if event == "call" and wanted.setdefault(code, code.co_filename.startswith(folders) and code.co_name[0] != "<"):
        order.setdefault((code.co_filename.removeprefix(source + "/"), code.co_qualname), None)
def traced(inputs, config, adjust=stages.adjust.run):
    sys.setprofile(follow)
    try:
        return adjust(inputs, config)
    finally:
        sys.setprofile(None)
stages.adjust.run = traced
words = f"run {session} --config {session}/pool.yaml --run {run} --jobs 1 --no-report --no-recordings"
call(words.split())
Path(result).write_text(json.dumps(list(order)))
"""
SMALL = {
    "track": {"distances_m": [4.0, 7.0], "half_length_m": 3.6},
    "laser": {"point_rate_hz": 2000.0, "line_rate_hz": 20.0, "format": "las"},
    "mbes": {"ping_rate_hz": 8.0},
    "ins": {"rate_hz": 50.0},
}


def trees(source: Path) -> Iterator[tuple[str, ast.Module]]:
    """Yield the name and the syntax tree of each module of PACKAGES in a checkout, sorted by name."""
    for package in PACKAGES:
        for path in sorted((source / package).rglob("*.py")):
            yield path.relative_to(source).as_posix(), ast.parse(path.read_text(encoding="utf-8"))


def names_with_two_meanings(source: Path) -> dict[str, list[str]]:
    """Return the modules that define each public class or function name which several modules define."""
    places: dict[str, list[str]] = defaultdict(list)
    for file, tree in trees(source):
        for node in tree.body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and not node.name.startswith("_"):
                places[node.name].append(file)
    return {name: files for name, files in sorted(places.items()) if len(files) > 1 and name not in PROTOCOLS}


def calls_with_many_arguments(source: Path) -> list[str]:
    """Return ``file:line name`` of each call with MANY_ARGUMENTS or more positional arguments."""
    return [
        f"{file}:{node.lineno} {ast.unparse(node.func)}"
        for file, tree in trees(source)
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and len(node.args) >= MANY_ARGUMENTS
    ]


def way_of_adjust(source: Path) -> list[tuple[str, str]]:
    """Return (file, function) of each function called in stage adjust, in the order of first calls."""
    with tempfile.TemporaryDirectory() as name:
        folder, environment = Path(name), os.environ | {"PYTHONPATH": str(source)}
        (folder / "scenario.yaml").write_text(json.dumps(SMALL), encoding="utf-8")
        python = [sys.executable, "-P"]
        simulate = [*python, "-m", "stages.cli", "simulate", "session", "--scenario", "scenario.yaml"]
        subprocess.run(simulate, cwd=folder, env=environment, check=True, capture_output=True)
        trace = [*python, "-c", TRACE, str(source), "session", "run", "order.json"]
        subprocess.run(trace, cwd=folder, env=environment, check=True, capture_output=True)
        return [(file, function) for file, function in json.loads((folder / "order.json").read_text(encoding="utf-8"))]


def entries(way: list[tuple[str, str]]) -> int:
    """Return how often a reader enters a file who follows these functions in their order.

    >>> entries([("a", "f"), ("a", "g"), ("b", "h"), ("a", "k")])
    3
    """
    files = [file for file, _ in way]
    return sum(file != before for file, before in zip(files, [None, *files], strict=False))


def sizes(source: Path) -> str:
    """Return a sentence about the lengths of modules and functions, in lines."""
    modules = {path: len((source / path).read_text(encoding="utf-8").splitlines()) for path, _ in trees(source)}
    functions = {
        f"{file}:{node.name}": (node.end_lineno or 0) - node.lineno + 1
        for file, tree in trees(source)
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
    }
    whole = {file: lines for file, lines in modules.items() if not file.endswith("__init__.py")}
    flat = sum(file.count("/") == 1 for file in whole if file.startswith("pipeline/"))
    longest, slowest = max(whole, key=lambda file: whole[file]), max(functions, key=lambda name: functions[name])
    return (
        f"{len(whole)} modules, {flat} of them flat in pipeline/; median {statistics.median(whole.values()):g} lines, "
        f"longest {whole[longest]} ({longest}); longest function {functions[slowest]} ({slowest})"
    )


def main() -> None:
    """Print the counts and sizes of a checkout."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "checkout", type=Path, nargs="?", default=ROOT, metavar="CHECKOUT", help="a worktree; default: this one"
    )
    parser.add_argument("--list", action="store_true", help="print every item that is counted")
    options = parser.parse_args()
    source = options.checkout.resolve()
    names, calls, way = names_with_two_meanings(source), calls_with_many_arguments(source), way_of_adjust(source)
    if options.list:
        print("\n".join(f"{name}: {', '.join(files)}" for name, files in names.items()))
        print("\n".join(calls))
        print("\n".join(f"{file} {function}" for file, function in way))
    print(f"public names defined in more than one module: {len(names)}")
    files = {file for file, _ in way}
    flat = sum(file.startswith("pipeline/") and file.count("/") == 1 for file in files)
    entered = f"{len(files)}, {flat} of them flat in pipeline/; entered {entries(way)} times"
    print(f"files on the way of stage adjust: {entered}")
    print(f"calls with {MANY_ARGUMENTS} or more positional arguments: {len(calls)}")
    print(sizes(source))


if __name__ == "__main__":
    main()
