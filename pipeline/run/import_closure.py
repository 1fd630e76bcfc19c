"""Which of the program's files a stage's result can depend on: those that its module imports, and what these import.

The imports are read from the syntax trees. So nothing is run, and the answer is the same on every machine. An import
counts wherever it stands in a file, except where only the type checker sees it. A program that a module starts counts
as imported: the module names the file that lies beside it. An import merely passes through some packages (``pipeline``
in ``pipeline.maths.geometry.planes``) and runs their first level only: imports in their functions count only where the
package itself is imported.
"""

import ast
import functools
from collections.abc import Iterator, Sequence
from pathlib import Path

PACKAGES = ("pipeline", "stages")  # all else is a library, which its version stands for


def import_closure(root: Path, modules: Sequence[str]) -> list[Path]:
    """Return the files that modules can reach, and the data files that lie beside these; sorted.

    Parameters
    ----------
    root
        The folder in which PACKAGES lie.
    modules
        Dotted names.
    """
    closure: set[Path] = set()
    waiting = [(name, True) for name in modules]
    visited: set[tuple[str, bool]] = set()
    while waiting:
        name, inside = waiting.pop()
        if (name, inside) in visited:
            continue
        visited.add((name, inside))
        waiting += [(package, False) for package in _packages_above(name)]
        path = file_of_module(root, name)
        if path is not None:
            closure.add(path)
            waiting += [(module, True) for module in imported_modules(root, path, name, inside)]
    folders = {path.parent for path in closure}
    return sorted(closure | {path for folder in folders for path in folder.iterdir() if _is_data(path)})


def _is_data(path: Path) -> bool:
    """Return whether it is a file that somebody wrote beside modules: nothing hidden, nothing that Python makes."""
    return not path.name.startswith(".") and path.suffix not in (".py", ".pyc") and path.is_file()


def _packages_above(name: str) -> list[str]:
    """Return the packages in which a module lies.

    >>> _packages_above("pipeline.maths.geometry.planes")
    ['pipeline', 'pipeline.maths', 'pipeline.maths.geometry']
    """
    parts = name.split(".")
    return [".".join(parts[:count]) for count in range(1, len(parts))]


def file_of_module(root: Path, name: str) -> Path | None:
    """Return the file of a module; None: there is none under ``root``."""
    place = root / name.replace(".", "/")
    for path in (place.with_name(place.name + ".py"), place / "__init__.py"):
        if path.is_file():
            return path
    return None


def imported_modules(root: Path, path: Path, name: str, inside: bool = True) -> list[str]:
    """Return the modules of PACKAGES that a module's file imports, and the programs beside it that it names.

    Parameters
    ----------
    root
        The folder in which PACKAGES lie.
    path, name
        The module's file, which may lie elsewhere, and dotted name.
    inside
        Also what its functions import.
    """
    modules: dict[str, None] = {}
    for base, word in _imports(path, name, inside):
        if base.partition(".")[0] in PACKAGES:
            inner = f"{base}.{word}" if word else base
            modules[inner if file_of_module(root, inner) else base] = None
    return list(modules)


@functools.cache
def _imports(path: Path, name: str, inside: bool) -> tuple[tuple[str, str], ...]:
    """Return ``import a.b`` as ("a.b", ""), ``from a import b`` as ("a", "b"), as is the program "b.py" beside a.c."""
    tree = ast.parse(path.read_bytes())
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    imports: list[tuple[str, str]] = []
    for node in _nodes(tree, inside):
        if isinstance(node, ast.Import):
            imports += [(alias.name, "") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*above, *filter(None, [node.module])])
            imports += [(base, alias.name) for alias in node.names]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and _is_program(node.value, path):
            imports.append((package, node.value.removesuffix(".py")))
    return tuple(dict.fromkeys(imports))


def _is_program(text: str, path: Path) -> bool:
    """Return whether a text in a module's file is the name of another one beside it."""
    return text.endswith(".py") and "/" not in text and path.with_name(text).is_file()


def _nodes(tree: ast.AST, inside: bool) -> Iterator[ast.AST]:
    """Yield what a module runs; ``inside``: also what its functions run, once they are called."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING"):
            yield from (inner for branch in node.orelse for inner in (branch, *_nodes(branch, inside)))
            continue
        yield node
        if inside or not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            yield from _nodes(node, inside)
