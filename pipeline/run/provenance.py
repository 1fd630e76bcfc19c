"""What a result follows from beside its settings and inputs: files of this program, and versions of libraries.

Presets and scenarios (``configs/``) are not among them: what a preset says stands in the settings, value by value.
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
from pipeline.run.import_closure import file_of, imported, reached
from pipeline.run.stage_protocol import declared

LIBRARIES = (  # that can change a digit: they compute, or decode raw files, meshes or tables
    "numpy", "scipy", "pandas", "pyarrow", "pyproj", "open3d-cpu", "laspy", "lazrs", "novatel-edie", "pye57", "gsfu",
    "pykmall", "trimesh",
)  # fmt: skip
ROOT = Path(pipeline.__file__).parent.parent
CALLS = ("pipeline.run.stage_protocol",)  # calls every stage, and writes its streams
CARRIES = ("pipeline/run/runner.py", "pipeline/run/workers.py")  # carry data in and out; what else they import does not


@functools.cache
def versions() -> dict[str, str]:
    """Versions of Python, this program and the libraries that can change a digit."""
    found = {"poolcal": pipeline.__version__, "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


def source_of(stage: ModuleType) -> dict[str, str]:
    """Digests of the program's files that the stage can reach; the readers' too, where it is given raw files."""
    raw = any(isinstance(marker, RawFiles) for marker in declared(stage.Inputs).values())
    return dict(_source(ROOT, stage.__name__, Path(str(stage.__file__)), raw))


@functools.cache
def _source(root: Path, name: str, own: Path, raw: bool) -> dict[str, str]:
    begin = [*CALLS, *(["pipeline.readers"] if raw else [])]
    ours = file_of(root, name) == own
    files = reached(root, [*([name] if ours else imported(root, own, name)), *begin])
    found = {path.relative_to(root).as_posix(): path for path in files}
    if not ours:  # a stage from elsewhere
        found[f"{own.parent.name}/{own.name}"] = own
    found |= {file: root / file for file in CARRIES}
    return {file: sha256(path) for file, path in sorted(found.items())}


@functools.cache
def git_commit() -> str | None:
    """The commit this program was checked out at, where git and a repository are there to tell."""
    if not (ROOT / ".git").exists():
        return None
    command = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return answer.stdout.strip() or None
