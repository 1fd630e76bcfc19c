"""Which of the program's files a stage's result can depend on: those that its module imports, and what these import.

The imports are read from the syntax trees, so nothing is run and the answer is the same on every machine. An import
counts wherever it stands in a file, but for those that only the type checker sees. A package that an import merely
passes through (``pipeline`` in ``pipeline.maths.geometry.planes``) is run as far as its first level: what its functions
import counts only where the package itself is imported.
"""

import ast
import functools
from collections.abc import Iterator, Sequence
from pathlib import Path

PACKAGES = ("pipeline", "stages")  # all else is a library, which its version stands for
WHOLE = ("pipeline.readers",)  # folders with programs, which no import reaches: with all their files


def reached(root: Path, modules: Sequence[str]) -> list[Path]:
    """The files of PACKAGES, which lie in the folder ``root``, that ``modules`` can reach, and data files that lie
    beside them; sorted."""
    found: set[Path] = set()
    waiting = [(name, True) for name in modules]
    seen: set[tuple[str, bool]] = set()
    while waiting:
        name, inside = waiting.pop()
        if (name, inside) in seen:
            continue
        seen.add((name, inside))
        waiting += [(parent, False) for parent in _parents(name)]
        if name in WHOLE:
            files = [path for path in (root / name.replace(".", "/")).rglob("*") if is_source(path)]
            found.update(files)
            waiting += [(_module(root, path), True) for path in files if path.suffix == ".py"]
        path = file_of(root, name)
        if path is not None:
            found.add(path)
            waiting += [(one, True) for one in imported(root, path, name, inside)]
    beside = {path for folder in {one.parent for one in found} for path in folder.iterdir() if path.suffix != ".py"}
    return sorted(found | {path for path in beside if is_source(path)})


def is_source(path: Path) -> bool:
    """A file that somebody wrote: nothing hidden, nothing that Python makes of it."""
    hidden = any(part.startswith(".") or part == "__pycache__" for part in path.parts[-3:])
    return not hidden and path.suffix != ".pyc" and path.is_file()


def _parents(name: str) -> list[str]:
    """
    >>> _parents("pipeline.maths.geometry.planes")
    ['pipeline', 'pipeline.maths', 'pipeline.maths.geometry']
    """
    parts = name.split(".")
    return [".".join(parts[:count]) for count in range(1, len(parts))]


def file_of(root: Path, name: str) -> Path | None:
    """The file of a module; None: there is none under ``root``."""
    place = root / name.replace(".", "/")
    for path in (place.with_name(place.name + ".py"), place / "__init__.py"):
        if path.is_file():
            return path
    return None


def _module(root: Path, path: Path) -> str:
    return ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__")


def imported(root: Path, path: Path, name: str, inside: bool = True) -> list[str]:
    """Modules of PACKAGES that a module's file imports; ``inside``: also those that its functions import."""
    found: dict[str, None] = {}
    for base, word in _imports(path, name, inside):
        if base.partition(".")[0] in PACKAGES:
            inner = f"{base}.{word}" if word else base
            found[inner if file_of(root, inner) else base] = None
    return list(found)


@functools.cache
def _imports(path: Path, name: str, inside: bool) -> tuple[tuple[str, str], ...]:
    """``import a.b`` as ("a.b", ""), ``from a import b`` as ("a", "b")."""
    tree = ast.parse(path.read_bytes())
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found: list[tuple[str, str]] = []
    for node in _nodes(tree, inside):
        if isinstance(node, ast.Import):
            found += [(alias.name, "") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*above, *filter(None, [node.module])])
            found += [(base, alias.name) for alias in node.names]
    return tuple(dict.fromkeys(found))


def _nodes(tree: ast.AST, inside: bool) -> Iterator[ast.AST]:
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING"):
            yield from (one for branch in node.orelse for one in (branch, *_nodes(branch, inside)))
            continue
        yield node
        if inside or not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            yield from _nodes(node, inside)
