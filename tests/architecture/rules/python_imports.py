"""Imports between the files of a Python package.

An imported name counts as an import of the file that defines it, also if an `__init__.py` re-exports it. Imports
inside functions and under `TYPE_CHECKING` count, except the `DELEGATIONS` of the layout.
"""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

from .layout import DELEGATIONS
from .source import text_of


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(text_of(path))


def is_for_types(node: ast.AST) -> bool:
    """True for an `if TYPE_CHECKING:` statement, whose imports are not executed."""
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def import_nodes(path: Path, *, top_level_only: bool = False) -> list[ast.Import | ast.ImportFrom]:
    """The import statements that are executed when the file is imported."""
    body = [node for node in tree_of(path).body if not is_for_types(node)]
    nodes = body if top_level_only else [inner for node in body for inner in ast.walk(node)]
    return [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]


def all_imports(path: Path) -> list[ast.Import | ast.ImportFrom]:
    """All import statements of a file: at the top, in functions and under `TYPE_CHECKING`."""
    return [node for node in ast.walk(tree_of(path)) if isinstance(node, ast.Import | ast.ImportFrom)]


def imported_packages(path: Path, *, top_level_only: bool = False) -> set[str]:
    """Packages that a file imports; relative imports keep their leading dots."""
    found = set()
    for node in import_nodes(path, top_level_only=top_level_only):
        if isinstance(node, ast.Import):
            found |= {name.name.split(".")[0] for name in node.names}
        elif node.level:
            found |= {f"{'.' * node.level}{node.module or name.name}" for name in node.names}
        else:
            found.add((node.module or "").split(".")[0])
    return found


def arrows(package: Path) -> dict[str, set[str]]:
    """For each file of the package, the files whose definitions it imports."""
    found: dict[str, set[str]] = {}
    for path in sorted(package.rglob("*.py")):
        name = path.relative_to(package).as_posix()
        at_start = files_of(package, path, import_nodes(path, top_level_only=True))
        found[name] = files_of(package, path, all_imports(path)) - (DELEGATIONS.get(name, set()) - at_start)
    return found


def files_of(package: Path, path: Path, nodes: list[ast.Import | ast.ImportFrom]) -> set[str]:
    """The files of the package that the import statements of a file refer to."""
    targets = {target for node in nodes for target in _targets(package, path, node)}
    return {target.relative_to(package).as_posix() for target in targets if target != path}


def _targets(package: Path, path: Path, node: ast.Import | ast.ImportFrom) -> set[Path]:
    if isinstance(node, ast.Import):
        names = [name.name.split(".") for name in node.names]
        files = {_file(package.joinpath(*parts[1:])) for parts in names if parts[0] == package.name}
        return {file for file in files if file is not None}
    base = _base(package, path, node)
    if base is None:
        return set()
    if path.name == "__init__.py" and base.is_relative_to(path.parent) and _only_hands_on(path, node):
        return set()
    found = {_definition(package, base, name.name, set()) for name in node.names}
    return {file for file in found if file is not None}


def _base(package: Path, path: Path, node: ast.ImportFrom) -> Path | None:
    """The folder or file (without extension) named by a `from … import`.

    Returns None for modules outside the package.
    """
    parts = node.module.split(".") if node.module else []
    if node.level:
        folder = path.parent
        for _ in range(node.level - 1):
            folder = folder.parent
        return folder.joinpath(*parts)
    return package.joinpath(*parts[1:]) if parts[:1] == [package.name] else None


def _only_hands_on(path: Path, node: ast.ImportFrom) -> bool:
    """True if an `__init__.py` only re-exports these names."""
    used = {inner.id for inner in ast.walk(tree_of(path)) if isinstance(inner, ast.Name)}
    return not used & {name.asname or name.name for name in node.names}


def _file(module: Path) -> Path | None:
    for file in (module.with_name(f"{module.name}.py"), module / "__init__.py"):
        if file.exists():
            return file
    return None


def _definition(package: Path, base: Path, name: str, seen: set[tuple[Path, str]]) -> Path | None:
    """The file that defines `name`, imported from the module `base`."""
    file = _file(base)
    if file is None or (file, name) in seen:
        return _file(base / name)
    seen.add((file, name))
    for node in tree_of(file).body:
        if isinstance(node, ast.ImportFrom) and name in {alias.asname or alias.name for alias in node.names}:
            source = _base(package, file, node)
            if source is None:
                continue
            original = next(alias.name for alias in node.names if (alias.asname or alias.name) == name)
            return _definition(package, source, original, seen) or file
    if file.name == "__init__.py":
        return None if (base / f"{name}.pyi").exists() else _file(base / name) or file
    return file
