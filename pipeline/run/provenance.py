"""What a result depends on beside its settings and inputs: files of this program, and versions of libraries.

Presets and scenarios (``configs/``) do not count: the settings contain every value of a preset.
"""

import functools
import platform
import subprocess
from importlib import metadata
from pathlib import Path
from types import ModuleType

import pipeline
from pipeline.artefacts.schema import RawFiles
from pipeline.atomic_files import sha256
from pipeline.run.import_closure import file_of_module, import_closure, imported_modules
from pipeline.run.stage_protocol import declared

LIBRARIES = (  # libraries that can change a digit: they compute, or decode raw files, meshes or tables
    "numpy", "scipy", "pandas", "pyarrow", "pyproj", "open3d-cpu", "laspy", "lazrs", "novatel-edie", "pye57", "gsfu",
    "pykmall", "trimesh", "numba", "llvmlite",
)  # fmt: skip
ROOT = Path(pipeline.__file__).parent.parent
CALLS = ("pipeline.run.stage_protocol",)  # calls every stage, and writes its streams
READS = ("pipeline.readers.dispatch",)  # makes the parts of raw files for the stages that read them
# These files pass data to and from a stage. The files that they import do not, and are left out.
CARRIES = ("pipeline/run/execute.py", "pipeline/run/stage_files.py", "pipeline/run/workers.py")


@functools.cache
def library_versions() -> dict[str, str]:
    """Return the versions of Python, this program and the libraries that can change a digit."""
    versions = {"poolcal": pipeline.__version__, "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            versions[name] = "not installed"
    return versions


def source_digests(stage: ModuleType) -> dict[str, str]:
    """Return the digests of the program's files on which the stage depends, with the readers if it reads raw files."""
    raw = any(isinstance(marker, RawFiles) for marker in declared(stage.Inputs).values())
    return dict(_source_digests(ROOT, stage.__name__, Path(str(stage.__file__)), raw))


@functools.cache
def _source_digests(root: Path, name: str, own: Path, raw: bool) -> dict[str, str]:
    ours = file_of_module(root, name) == own
    begin = [*([name] if ours else imported_modules(root, own, name)), *CALLS, *(READS if raw else ())]
    files = {path.relative_to(root).as_posix(): path for path in import_closure(root, begin)}
    if not ours:  # the stage is not part of this program
        files[f"{own.parent.name}/{own.name}"] = own
    files |= {file: root / file for file in CARRIES}
    return {file: sha256(path) for file, path in sorted(files.items())}


@functools.cache
def digests_of(*modules: str) -> dict[str, str]:
    """Return the digests of the program's files on which these modules depend."""
    return {path.relative_to(ROOT).as_posix(): sha256(path) for path in import_closure(ROOT, modules)}


@functools.cache
def git_commit() -> str | None:
    """Return the commit at which this program was checked out; None without git or a repository."""
    if not (ROOT / ".git").exists():
        return None
    command = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return answer.stdout.strip() or None
