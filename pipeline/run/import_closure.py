"""The files of the program on which a stage's result can depend: all files that its module imports, directly or not.

The imports are read from the syntax trees. Therefore no module is run, and the answer is the same on every machine. An
import counts wherever it stands in a file, except in a block for the type checker. If a module names a program file in
its own folder, because it starts this program, the file counts as imported. To import
``pipeline.maths.geometry.planes``, Python also runs the packages above it (``pipeline``, ``pipeline.maths``, ...), but
calls none of their functions. Imports in these functions count only if the package itself is imported.
"""

import ast
import functools
import hashlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from pipeline.atomic_files import sha256
from pipeline.run.known_imports import KnownImports

PACKAGES = ("pipeline", "stages")  # every other package is a library, identified by its version
KNOWN = KnownImports(Path(__file__).with_name("__pycache__") / f"imports-{sha256(Path(__file__))[:12]}.json")
STATEMENTS = (ast.stmt, ast.excepthandler, ast.match_case)  # these hold all statements of a module


def import_closure(root: Path, modules: Sequence[str]) -> list[Path]:
    """Return the files that ``modules`` import, directly or not, and the data files in their folders; sorted.

    Parameters
    ----------
    root
        The folder in which PACKAGES lie.
    modules
        Dotted names of modules.
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
        path, imported = _found(root, name, inside)
        if path is not None:
            closure.add(path)
            waiting += [(module, True) for module in imported]
    KNOWN.keep()
    folders = {path.parent for path in closure}
    return sorted(closure | {path for folder in folders for path in folder.iterdir() if _is_data(path)})


@functools.cache  # the stages' closures share most of their modules
def _found(root: Path, name: str, inside: bool) -> tuple[Path | None, list[str]]:
    """Return a module's file, and the modules that it imports; None and none if ``root`` does not contain it."""
    path = file_of_module(root, name)
    return path, [] if path is None else imported_modules(root, path, name, inside)


def _is_data(path: Path) -> bool:
    """Return whether ``path`` is a data file: it is not hidden, and neither a module nor compiled by Python."""
    return not path.name.startswith(".") and path.suffix not in (".py", ".pyc") and path.is_file()


def _packages_above(name: str) -> list[str]:
    """Return the packages in which a module lies.

    >>> _packages_above("pipeline.maths.geometry.planes")
    ['pipeline', 'pipeline.maths', 'pipeline.maths.geometry']
    """
    parts = name.split(".")
    return [".".join(parts[:count]) for count in range(1, len(parts))]


def file_of_module(root: Path, name: str) -> Path | None:
    """Return the file of a module; None if ``root`` does not contain it."""
    place = os.path.join(root, *name.split("."))
    for path in (f"{place}.py", os.path.join(place, "__init__.py")):  # thousands: as texts in a third of the time
        if os.path.isfile(path):
            return Path(path)
    return None


def imported_modules(root: Path, path: Path, name: str, inside: bool = True) -> list[str]:
    """Return the modules of PACKAGES that a module's file imports, and the programs in its folder that it names.

    Parameters
    ----------
    root
        The folder in which PACKAGES lie.
    path, name
        The module's file, which may lie outside ``root``, and its dotted name.
    inside
        True: also the imports in its functions.
    """
    modules: dict[str, None] = {}
    for base, word in _imports(path, name, inside):
        if base.partition(".")[0] in PACKAGES:
            inner = f"{base}.{word}" if word else base
            modules[inner if file_of_module(root, inner) else base] = None
    return list(modules)


@functools.cache
def _imports(path: Path, name: str, inside: bool) -> tuple[tuple[str, str], ...]:
    """Return a file's imports as pairs: ``import a.b`` as ("a.b", ""), ``from a import b`` as ("a", "b").

    If module a.c names the program "b.py" in its folder, the pair is ("a", "b") too.
    """
    source = path.read_bytes()
    if b".py" in source:  # it may name programs, and whether there are such depends on its folder
        return _parsed(source, path, name, inside)
    key = hashlib.sha256(b"\0".join([name.encode(), path.name.encode(), b"%d" % inside, source])).hexdigest()
    found = KNOWN.get(key)
    if found is None:
        found = _parsed(source, path, name, inside)
        KNOWN.put(key, found)
    return found


def _parsed(source: bytes, path: Path, name: str, inside: bool) -> tuple[tuple[str, str], ...]:
    tree = ast.parse(source)
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    imports: list[tuple[str, str]] = []
    for node in _nodes(tree, inside, expressions=b".py" in source):
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
    """Return whether ``text`` is the name of a module's file in the folder of the module ``path``."""
    return text.endswith(".py") and "/" not in text and path.with_name(text).is_file()


def _nodes(tree: ast.AST, inside: bool, expressions: bool) -> Iterator[ast.AST]:
    """Yield the syntax nodes that run when a module is imported.

    Parameters
    ----------
    tree
        The module.
    inside
        True: also the nodes in its functions.
    expressions
        False: statements alone. They are a tenth of the nodes, and an import is a statement.
    """
    kinds: tuple[type[ast.AST], ...] = (ast.AST,) if expressions else STATEMENTS
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        if isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING"):
            waiting += node.orelse
        elif inside or not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            for inner in vars(node).values():
                if isinstance(inner, list):
                    waiting += [one for one in inner if isinstance(one, kinds)]
                elif isinstance(inner, kinds):
                    waiting.append(inner)
