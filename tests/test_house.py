"""Rules of the house that no linter holds: who may import what, and what make promises."""

import ast
import graphlib
import statistics
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.run.import_closure import imported_modules
from tests.support.roots import ROOT

MOST_LINES_OF_A_MODULE, MEDIAN_LINES_OF_A_MODULE, MOST_LINES_OF_A_FUNCTION = 300, 110, 60


def _imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _sources() -> dict[str, Path]:
    """Every module of the program by its dotted name."""
    files = [*(ROOT / "pipeline").rglob("*.py"), *(ROOT / "stages").rglob("*.py")]
    return {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path for path in files}


def test_maths_is_pure() -> None:
    for path in (ROOT / "pipeline" / "maths").rglob("*.py"):
        for name in _imports(path):
            top = name.split(".")[0]
            ours = name.startswith(("pipeline.errors.", "pipeline.maths."))
            pure = top in sys.stdlib_module_names and top != "os"
            assert ours or pure or top in ("numpy", "scipy", "numba"), (path, name)


def test_open3d_and_rerun_have_their_places() -> None:
    allowed = {"open3d": ("pipeline/target/surface.py", "pipeline/simulation/raycast.py"), "rerun": ("stages/views/",)}
    for path in _sources().values():
        for name in _imports(path):
            places = allowed.get(name.split(".")[0], ("",))
            assert path.relative_to(ROOT).as_posix().startswith(places), (path, name)


def test_no_module_needs_itself() -> None:
    """No circle of imports, those inside functions included."""
    sources = _sources()
    needs = {
        module: {name if name in sources else name.rpartition(".")[0] for name in imported_modules(ROOT, path, module)}
        for module, path in sources.items()
    }
    try:
        graphlib.TopologicalSorter(needs).prepare()
    except graphlib.CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def _tests_and_tools() -> list[Path]:
    return [*(ROOT / "tests").rglob("*.py"), *(ROOT / "tools").rglob("*.py")]


def test_modules_and_functions_are_short() -> None:
    lengths = {}
    for module, path in _sources().items():
        text = path.read_text(encoding="utf-8")
        if path.name != "__init__.py":
            lengths[module] = len(text.splitlines())
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef):
                assert (node.end_lineno or 0) - node.lineno < MOST_LINES_OF_A_FUNCTION, (path, node.name)
    assert {name: lines for name, lines in lengths.items() if lines > MOST_LINES_OF_A_MODULE} == {}
    assert statistics.median(lengths.values()) < MEDIAN_LINES_OF_A_MODULE
    for path in _tests_and_tools():
        assert len(path.read_text(encoding="utf-8").splitlines()) <= MOST_LINES_OF_A_MODULE, path


def test_what_tests_share_is_in_support() -> None:
    """No module imports from a module of tests: what several need is in tests/support or a conftest."""
    for path in _tests_and_tools():
        for name in _imports(path):
            shared = name.startswith("tests.support.") or ".conftest." in name
            assert not name.startswith("tests.") or shared, (path, name)


def test_tests_are_in_the_rooms_of_what_they_test() -> None:
    """Beside the rooms of the library: tests of the stages, of all together, of its results, and what they share."""
    beside = {"stages", "cli", "end_to_end", "golden", "real", "visual", "support"}
    for below, others in (("", beside), ("maths", set())):
        rooms = {path.parent.name for path in (ROOT / "pipeline" / below).glob("*/__init__.py")}
        folders = {path.parent.name for path in (ROOT / "tests" / below).glob("*/*.py")}
        folders |= {path.parent.parent.name for path in (ROOT / "tests" / below).glob("*/*/*.py")}
        assert folders - rooms - others == set()


def test_the_library_has_rooms() -> None:
    """No module lies beside the packages but those that all of them may use."""
    leaves = {path.stem for path in (ROOT / "pipeline").glob("*.py")}
    assert leaves == {"__init__", "atomic_files", "console", "errors", "gps_time", "mount", "text_table"}


def _make(*words: str) -> str:
    command = ["make", "--no-print-directory", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_make_explains_itself() -> None:
    shown = _make()
    for target in ("setup", "demo", "calibrate", "repeat", "test", "lint", "bench", "montecarlo"):
        assert f"make {target} " in shown


def test_make_calibrate_and_repeat_take_blanks() -> None:
    shown = _make("-n", "calibrate", "SESSION=my pool", "CONFIG=a b.yaml", "RUN=runs/c d", "JOBS=2")
    assert "run 'my pool' --config 'a b.yaml' --run 'runs/c d' --jobs 2" in shown
    assert "--overwrite" not in shown
    assert "repeat 'my fleet.yaml' --jobs 2" in _make("-n", "repeat", "FLEET=my fleet.yaml", "JOBS=2")
    words = ("SESSION=a", "CONFIG=b", "RUN=c", "OVERWRITE=1")
    assert "run 'a' --config 'b' --run 'c'  --overwrite" in _make("-n", "calibrate", *words)


def test_make_has_one_rule_a_stage_over_real_files(tmp_path: Path) -> None:
    from stages import ORDER

    (tmp_path / "laser").mkdir()
    for name in ("session.yaml", "laser/0.las", "pool.yaml"):
        (tmp_path / name).write_text("")
    words = ("-o", ".venv/.setup", f"SESSION={tmp_path}", f"CONFIG={tmp_path}/pool.yaml", f"RUN={tmp_path}/run")
    ran = [line.split()[2] for line in _make("-n", "stages", *words).splitlines() if "poolcal stage" in line]
    assert ran == list(ORDER)
    for stage in ORDER:
        (tmp_path / "run" / stage).mkdir(parents=True)
        (tmp_path / "run" / stage / "manifest.json").write_text("")
    assert "poolcal stage" not in _make("-n", "stages", *words)


def test_environment_does_not_steer_make(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RUN", "elsewhere")
    command = ["make", "-n", "calibrate", "SESSION=a", "CONFIG=b.yaml"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert "RUN= is missing" in done.stderr


def test_make_stages_refuses_blanks_aloud() -> None:
    command = ["make", "-n", "stages", "SESSION=a", "CONFIG=b.yaml", "RUN=c d"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert "use make calibrate" in done.stderr
