"""Test whether this checkout and another commit write the same bytes.

A worktree of BASE simulates sessions of several kinds once. Then BASE and this checkout run the same commands on copies
of them, each in a folder of its own: ``run`` or ``laser``, ``check --json``, ``plan --yaml``, ``coarse --yaml``,
``compare``, ``diff --json``, ``verify`` and ``history``. The program compares the SHA-256 of every Parquet file and
document that the commands write, the text that they print, their exit statuses, and ``calibration.json`` without
``software``. It leaves out ``manifest.json``, which holds digests of the source, and everything that is drawn;
``--pages`` includes the HTML pages.

Each difference is one line: kind of session, file, and the keys, columns or lines that differ. The exit status is 1 if
anything differs.

    python -m tools.same_bytes BASE [--only NAME ...] [--pages] [--keep FOLDER]
"""

import argparse
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from tools.session_kinds import KINDS, PLAN, Kind

ROOT = Path(__file__).parents[1]
PASSED_OVER = ("manifest.json", "digests.json", ".lock")  # digests of the source; paths and times; a process number
ELAPSED = re.compile(r"\d s\b")  # a message with the duration of a stage
VARIABLE = re.compile(  # differs between any two runs: the day of an edit, the commit, its digests, the folder
    r'(?<=date: ")\d{4}-\d\d-\d\d|\b[0-9a-f]{40}\b|(?<=calibration\.json", sha256: ")[0-9a-f]{64}'
    r"|/\S*/(base|here)/"
)


class Tree:
    """A checkout whose ``poolcal`` is run from its own source."""

    def __init__(self, source: Path, work: Path) -> None:
        self.work = work
        self._environment = os.environ | {"PYTHONPATH": str(source), "PYTHONDONTWRITEBYTECODE": "1"}

    def poolcal(self, folder: Path, *words: object) -> tuple[int, str, str]:
        """Run a command in ``folder`` and return its exit status, output and errors."""
        command = [sys.executable, "-P", "-m", "stages.cli", *map(str, words)]
        done = subprocess.run(
            command, cwd=folder, env=self._environment, capture_output=True, text=True, timeout=1800, check=False
        )
        if done.returncode == 3:
            raise RuntimeError(f"{folder}: poolcal {words[0]} is broken\n{done.stderr}")
        return done.returncode, done.stdout, done.stderr


def simulate(tree: Tree, kind: Kind, folder: Path) -> None:
    """Write session, pool.yaml, truth, plan and marks below a folder.

    Parameters
    ----------
    tree
        The checkout that simulates.
    kind
        The kind of session.
    folder
        A folder that does not exist yet.
    """
    folder.mkdir(parents=True)
    scenario = {}
    if kind.base is not None:
        scenario = _read(ROOT / "configs" / "scenarios" / f"{kind.base}.yaml")
    for name, block in kind.scenario.items():
        scenario[name] = scenario.get(name, {}) | block
    _write(folder / "scenario.yaml", scenario)
    status, _, errors = tree.poolcal(folder, "simulate", "session", "--scenario", "scenario.yaml", "--seed", 5)
    if status:
        raise RuntimeError(f"{folder.name}: cannot be simulated\n{errors}")
    shutil.move(folder / "session" / "pool.yaml", folder / "pool.yaml")
    for path, changes in ((folder / "session" / "session.yaml", kind.session), (folder / "pool.yaml", kind.pool)):
        content = _read(path)
        for name, block in changes.items():
            content[name] = content.get(name, {}) | block
        _write(path, content)
    _write(folder / "plan.yaml", PLAN)
    shutil.copy(ROOT / "configs" / "marks.yaml", folder / "marks.yaml")


def calibrate(tree: Tree, kind: Kind, folder: Path, pages: bool) -> None:
    """Run all commands on a copied session; the output of each goes to ``printed/``.

    Parameters
    ----------
    tree
        The checkout that calibrates.
    kind
        The kind of session.
    folder
        The copy.
    pages
        Whether the report is drawn.
    """
    config, quiet = ("--config", "pool.yaml"), ("--no-recordings", *(() if pages else ("--no-report",)))
    calls: dict[str, tuple[object, ...]] = {
        "check": ("check", "session", *config, "--json"),
        "check_text": ("check", "session", *config),
        "run": (kind.command, "session", *config, "--run", "runs/a", "--jobs", 1, *quiet),
        "verify": ("verify", "runs/a"),
        "coarse": ("coarse", "marks.yaml", "--session", "session", "--yaml", "coarse.yaml"),
    }
    if kind.command == "run":
        again = ("run", "session", *config, "--run", "runs/b", "--jobs", 2, *quiet)
        calls |= {
            "plan": ("plan", "plan.yaml", "--session", "session", *config, "--yaml", "prediction.yaml"),
            "compare": ("compare", "runs/a", "session.truth.json"),
            "again": again,  # with the mounts that coarse wrote, those of another boat: a result or one line
            "diff": ("diff", "runs/a", "runs/a", "--json"),
            "diff_text": ("diff", "runs/a", "runs/a"),
        }
    calls["history"] = ("history", "runs", "--out", "history")
    for name, words in calls.items():
        status, out, errors = tree.poolcal(folder, *words)
        messages = "\n".join(line for line in errors.splitlines() if not ELAPSED.search(line))
        _write_text(folder / "printed" / name, f"status {status}\n{out}\n{messages}\n")


def differences(kind: str, base: Path, here: Path, pages: bool) -> Iterator[str]:
    """Yield a line for each file that differs between the folders of the two checkouts.

    Parameters
    ----------
    kind
        Name of the kind, with which the lines begin.
    base, here
        The folders in which BASE and this checkout ran the commands.
    pages
        Whether drawn files are compared as well.
    """
    files = {at: {path.relative_to(at) for path in at.rglob("*") if path.is_file()} for at in (base, here)}
    for path in sorted(files[base] | files[here]):
        if path.name in PASSED_OVER or (path.suffix in (".html", ".svg", ".png", ".rrd") and not pages):
            continue
        if path not in files[base] or path not in files[here]:
            yield f"{kind}: {path}: only in {'BASE' if path in files[base] else 'this tree'}"
        elif _digest(base / path) != _digest(here / path):
            yield f"{kind}: {path}: {_how_they_differ(base / path, here / path)}"


def _digest(path: Path) -> str:
    if path.name == "calibration.json":
        content = json.loads(path.read_text(encoding="utf-8"))
        content.pop("software", None)
        data = json.dumps(content, sort_keys=False).encode()
    elif path.suffix in (".html", ".json", ".csv", ".yaml", ""):
        data = VARIABLE.sub("-", path.read_text(encoding="utf-8", errors="replace")).encode()
    else:
        data = path.read_bytes()
    return hashlib.sha256(data).hexdigest()


def _how_they_differ(base: Path, here: Path) -> str:
    """Return the first few keys, columns or lines in which two files differ."""
    if base.suffix == ".json":
        before, after = (_flat(json.loads(path.read_text(encoding="utf-8"))) for path in (base, here))
        names = [name for name in {**before, **after} if before.get(name) != after.get(name)]
        return f"keys {', '.join(sorted(name for name in names if not name.startswith('software'))[:8])}"
    if base.suffix == ".parquet":
        old, new = pd.read_parquet(base), pd.read_parquet(here)
        if list(old) != list(new) or len(old) != len(new):
            return f"columns or rows: {old.shape} {list(old)} and {new.shape} {list(new)}"
        names = [str(name) for name in old if not old[name].equals(new[name])]
        return f"columns {', '.join(names)}" if names else "only the metadata of its columns"
    lines = [path.read_text(encoding="utf-8", errors="replace").splitlines() for path in (base, here)]
    pairs = [pair for pair in zip(*lines, strict=False) if pair[0] != pair[1]]
    first = f", first {pairs[0][0]!r} and {pairs[0][1]!r}" if pairs else ""
    return f"{len(lines[0])} and {len(lines[1])} lines{first}"


def _flat(content: Any, name: str = "") -> dict[str, Any]:
    if isinstance(content, dict):
        return {key: value for k, v in content.items() for key, value in _flat(v, f"{name}.{k}".lstrip(".")).items()}
    return {name: content}


def _read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    return content


def _write(path: Path, content: dict[str, Any]) -> None:
    _write_text(path, yaml.safe_dump(content, sort_keys=False, allow_unicode=True))


def _write_text(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def compare(base: str, names: list[str], pages: bool, work: Path) -> list[str]:
    """Run both checkouts on sessions of these kinds and return the lines of ``differences``.

    Parameters
    ----------
    base
        A commit.
    names
        Keys of KINDS.
    pages
        Whether drawn files are compared as well.
    work
        Folder to work in.
    """
    source = work / "source"
    subprocess.run(["git", "worktree", "add", "--detach", "-f", "-q", str(source), base], cwd=ROOT, check=True)
    try:
        trees = (Tree(source, work / "base"), Tree(ROOT, work / "here"))

        def of_kind(name: str) -> list[str]:
            simulate(trees[0], KINDS[name], work / "simulated" / name)
            for tree in trees:
                shutil.copytree(work / "simulated" / name, tree.work / name)
                calibrate(tree, KINDS[name], tree.work / name, pages)
            lines = list(differences(name, trees[0].work / name, trees[1].work / name, pages))
            print("\n".join(lines) or f"{name}: the same", flush=True)
            return lines

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return [line for lines in pool.map(of_kind, names) for line in lines]
    finally:
        subprocess.run(["git", "worktree", "remove", "--force", str(source)], cwd=ROOT, check=True)


def main() -> None:
    """Compare, print the differences, and end with status 1 if there are any."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", metavar="BASE", help="the commit to compare with")
    parser.add_argument(
        "--only", nargs="+", choices=KINDS, default=list(KINDS), metavar="NAME",
        help=f"kinds of session: {', '.join(KINDS)}; default: all",
    )  # fmt: skip
    parser.add_argument("--pages", action="store_true", help="compare the HTML pages as well")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="new folder in which the results of both stay")
    options = parser.parse_args()
    if options.keep is not None:
        options.keep.mkdir(parents=True)
        lines = compare(options.base, options.only, options.pages, options.keep.resolve())
    else:
        with tempfile.TemporaryDirectory() as folder:
            lines = compare(options.base, options.only, options.pages, Path(folder))
    print(f"{len(lines)} files differ" if lines else "the same bytes")
    sys.exit(1 if lines else 0)


if __name__ == "__main__":
    main()
