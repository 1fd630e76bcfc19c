"""What a result follows from beside its settings: files of the program within reach, libraries, raw files."""

import json
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from pipeline.run import provenance, runner
from pipeline.run.import_closure import import_closure
from stages import load
from tests.support import toys
from tests.support.roots import ROOT
from tests.support.toy_run import Pool

# Settings are in the key as values.
NO_DIGIT = {"Babel", "rerun-sdk", "typer", "pydantic", "PyYAML", "ruamel.yaml", "jinja2", "matplotlib"}


# --- files of the program --------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program's files, to be changed."""
    root = tmp_path_factory.mktemp("program")
    for package in ("pipeline", "stages"):
        shutil.copytree(ROOT / package, root / package, ignore=shutil.ignore_patterns("__pycache__"))
    return root


def is_stale(copy: Path, monkeypatch: pytest.MonkeyPatch, stage: str, changed: str) -> bool:
    """Whether one more comment in a file of the program changes the key of a stage."""
    (module,) = [m for kind in ("mbes", "laser") for m in load(kind) if m.__name__ == f"stages.{stage}"][:1]
    here = ModuleType(module.__name__)
    vars(here).update(Inputs=module.Inputs, __file__=str(copy / Path(str(module.__file__)).relative_to(ROOT)))
    monkeypatch.setattr(provenance, "ROOT", copy)
    provenance._source_digests.cache_clear()
    before = provenance.source_digests(here)
    text = (copy / changed).read_bytes()
    (copy / changed).write_bytes(text + b"\n# a comma\n")
    provenance._source_digests.cache_clear()
    after = provenance.source_digests(here)
    (copy / changed).write_bytes(text)
    provenance._source_digests.cache_clear()
    assert {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)} <= {changed}
    return before != after


@pytest.mark.parametrize(
    ("stage", "changed"),
    [
        ("ingest", "stages/ingest.py"),
        ("ingest", "pipeline/readers/file_summaries.py"),
        ("ingest", "pipeline/maths/geometry/passes.py"),
        ("ingest", "pipeline/maths/geometry/rotations.py"),  # imported by geodesy.py, by nothing of ingest
        ("ingest", "pipeline/readers/detect.py"),  # the runner hands the readers' parts to it
        ("ingest", "pipeline/readers/laz_worker.py"),  # a program: imported by nobody
        ("ingest", "pipeline/readers/e57_worker.py"),
        ("ingest", "pipeline/readers/las.py"),
        ("ingest", "pipeline/artefacts/parquet.py"),
        ("ingest", "pipeline/run/stage_files.py"),
        ("ingest", "pipeline/__init__.py"),  # BLAS's threads
        ("segment", "pipeline/maths/target/registration.py"),
        ("adjust", "pipeline/maths/adjustment/eliminate_white_noise.py"),
        ("adjust", "pipeline/adjustment/laser_design.py"),
        ("report", "pipeline/report/verdict.py"),
    ],
)
def test_what_a_stage_can_reach_makes_it_stale(
    copy: Path, monkeypatch: pytest.MonkeyPatch, stage: str, changed: str
) -> None:
    assert is_stale(copy, monkeypatch, stage, changed)


@pytest.mark.parametrize(
    ("stage", "changed"),
    [
        ("ingest", "pipeline/checking/check_session.py"),
        ("ingest", "pipeline/coarse/mounts_from_marks.py"),
        ("ingest", "pipeline/report/verdict.py"),
        ("ingest", "pipeline/maths/adjustment/normal_equations.py"),
        ("ingest", "stages/adjust.py"),
        ("ingest", "pipeline/readers/casts.py"),  # the cast's depths are in the settings
        ("ingest", "pipeline/config/load.py"),  # as are all that it loads
        ("ingest", "pipeline/run/manifest.py"),
        ("ingest", "pipeline/run/runner.py"),
        ("report", "pipeline/run/results.py"),
        ("report", "pipeline/run/progress.py"),
        ("georeference", "pipeline/readers/las.py"),  # its inputs tell whether that made a difference
        ("report", "pipeline/results/pages/report.html"),
        ("report", "pipeline/results/screen.py"),
        ("report", "pipeline/simulation/laser.py"),
    ],
)
def test_what_it_cannot_reach_does_not(copy: Path, monkeypatch: pytest.MonkeyPatch, stage: str, changed: str) -> None:
    assert not is_stale(copy, monkeypatch, stage, changed)


BASE = {"artefacts", "config", "maths", "run"}  # of every stage: schemas, settings, and what carries rows in and out
ADJUST = {"adjustment", "planning", "target"}  # the planner's geometry names what the passes lack
REPORT = {"adjustment", "limits", "report", "target"}
ROOMS = {  # packages of pipeline/ of which a stage reaches some file, beside BASE
    "ingest": {"readers"},
    "georeference": {"georeference", "target"},
    "segment": {"adjustment", "target"},
    "fit_planes": set[str](),
    "angle_iterate": set[str](),
    "offsets": set[str](),
    "adjust": ADJUST,
    "report": REPORT,
}
FILES = {  # of these packages, these files alone
    "run": {"__init__.py", "execute.py", "stage_files.py", "stage_protocol.py", "workers.py"},
}
NEVER = (
    "pipeline/config/load.py", "pipeline/readers/casts.py", "pipeline/maths/survey/frame", "pipeline/maths/survey/data",
    "pipeline/maths/comparison.py",
)  # fmt: skip
LATE = ("pipeline/maths/adjustment/", "pipeline/console.py")  # only of stages that adjust


@pytest.mark.parametrize("stage", ROOMS)
def test_a_stage_reaches_what_it_computes_with_and_no_more(stage: str) -> None:
    (module,) = {m.__name__: m for m in (*load(), *load("laser")) if m.__name__ == f"stages.{stage}"}.values()
    files = [Path(name) for name in provenance.source_digests(module)]
    rooms = {path.parts[1] for path in files if path.parts[0] == "pipeline"}
    assert {room for room in rooms if not room.endswith(".py")} == BASE | ROOMS[stage]
    for room, names in FILES.items():
        assert {path.name for path in files if path.parts[1] == room} <= names
    own = {Path("stages/__init__.py"), Path("stages", f"{stage}.py")}
    assert {path for path in files if path.parts[0] == "stages"} == own
    between = stage in ("georeference", "fit_planes", "angle_iterate", "offsets")
    assert [path for path in files if path.as_posix().startswith(NEVER + (LATE if between else ()))] == []
    assert all(path.suffix == ".py" for path in files)


def test_imports_are_followed_as_python_follows_them(tmp_path: Path) -> None:
    """Relative ones, those in functions and of packages; none that the type checker alone sees, none of a library."""
    modules = ("always", "up", "typed", "real", "started", "loaded", "unreached", "folder/face")
    files = {
        "stages/__init__.py": "def load():\n    import pipeline.loaded\n",
        "stages/one.py": "from typing import TYPE_CHECKING\nfrom pipeline import near\nimport numpy\n"
        "PROGRAM = 'program.py', 'none.py'\n"
        "if TYPE_CHECKING:\n    import pipeline.typed\nelse:\n    import pipeline.real\n",
        "stages/program.py": "import pipeline.started\n",
        "pipeline/__init__.py": "from . import always\n",
        "pipeline/near.py": "def late():\n    from pipeline.folder.deep import thing\n",
        "pipeline/folder/__init__.py": "from pipeline.folder import face\n"
        "def never():\n    import pipeline.unreached\n",
        "pipeline/folder/deep.py": "from ..up import other\n",
        "pipeline/folder/data.json": "{}",
        "numpy/__init__.py": "import pipeline.loaded\n",
    } | {f"pipeline/{name}.py": "" for name in modules}
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    found = {path.relative_to(tmp_path).as_posix() for path in import_closure(tmp_path, ["stages.one"])}
    left = ("pipeline/typed.py", "pipeline/loaded.py", "pipeline/unreached.py", "numpy/__init__.py")
    assert found == files.keys() - set(left)


def test_no_import_is_hidden() -> None:
    """What is imported by a name made at run time no syntax tree shows."""
    for stage in (*load(), *load("laser")):
        for name in provenance.source_digests(stage):
            text = (ROOT / name).read_text(encoding="utf-8")
            assert name == "stages/__init__.py" or "import_module(" not in text, name
            assert "__import__(" not in text, name


def test_every_module_that_a_stage_has_loaded_is_in_its_key() -> None:
    """Python's own list of what was imported is the judge."""
    code = (
        "import sys, json; import {0}; import pipeline.run.stage_protocol; ours = ('pipeline', 'stages');"
        "print(json.dumps([m.__file__ for name, m in sys.modules.items() if name.split('.')[0] in ours]))"
    )
    for stage in (load("laser")[-2], load()[0]):
        command = [sys.executable, "-c", code.format(stage.__name__)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
        loaded = {Path(name).relative_to(ROOT).as_posix() for name in json.loads(done.stdout)}
        assert len(loaded) > 20
        assert loaded <= provenance.source_digests(stage).keys()


# --- libraries -------------------------------------------------------------------------------------------------------
def test_every_dependency_is_recorded_or_known_to_change_no_digit() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    names = {re.split(r"[\[<>=~!; ]", one)[0] for one in project["dependencies"]}
    assert names == NO_DIGIT | set(provenance.LIBRARIES) - {"lazrs", "llvmlite"}  # which laspy and numba bring
    assert "not installed" not in provenance.library_versions().values()


@pytest.mark.parametrize("decoder", ["pye57", "gsfu", "pykmall", "lazrs"])
def test_a_decoders_new_version_reads_raw_files_again(
    pool: Pool, monkeypatch: pytest.MonkeyPatch, decoder: str
) -> None:
    pool.run()
    versions = provenance.library_versions()
    monkeypatch.setattr(provenance, "library_versions", lambda: {**versions, decoder: "0.0.1"})
    assert pool.run()[0] == "take"
    assert f"take: {decoder} {versions[decoder]} -> 0.0.1" in pool.said


# --- raw files -------------------------------------------------------------------------------------------------------
def test_a_result_tells_the_files_that_were_read_not_those_that_came_later(pool: Pool) -> None:
    """Somebody copies a file over another while the stages after ingest run."""
    tell = toys.stages()[2]
    tell.run = lambda inputs, config: toys.TellOutputs(json.dumps(inputs.provenance))
    path = pool.session / "laser" / "0.bin"
    before = path.read_bytes()

    def meanwhile(stage: str) -> None:
        if stage == "sift":
            np.ones(5).tofile(path)

    stages = (*toys.stages()[:2], tell)
    runner.run(stages, pool.session, pool.config, pool.run_folder, finished=meanwhile)
    told = json.loads((pool.run_folder / "tell" / "calibration.json").read_text())["inputs"]
    read = json.loads((pool.run_folder / "take" / "manifest.json").read_text())["key"]["raw"]
    assert read.items() <= told.items()
    assert set(told) == {"ins/0.bin", "laser/0.bin", "laser/1.bin", "mbes/0.bin"}
    assert runner.run(stages, pool.session, pool.config, pool.run_folder) == ["take", "sift", "tell"]
    path.write_bytes(before)
    runner.run(stages, pool.session, pool.config, pool.run_folder)
    assert json.loads((pool.run_folder / "tell" / "calibration.json").read_text())["inputs"] == told
