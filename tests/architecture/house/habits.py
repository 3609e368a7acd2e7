"""Habits: public Python is documented."""

from __future__ import annotations

import ast
from pathlib import Path

from .python_imports import tree_of
from .source import python_files


def undocumented_python(root: Path) -> list[str]:
    """Public modules, classes, functions, methods and properties without a docstring; a setter has its property's."""
    offences = []

    def is_setter(node: ast.ClassDef | ast.FunctionDef) -> bool:
        return any(isinstance(one, ast.Attribute) and one.attr == "setter" for one in node.decorator_list)

    def visit(node: ast.Module | ast.ClassDef | ast.FunctionDef, name: str) -> None:
        if not ast.get_docstring(node):
            offences.append(f"{name} has no docstring")
        for child in () if isinstance(node, ast.FunctionDef) else node.body:
            if not isinstance(child, ast.ClassDef | ast.FunctionDef) or is_setter(child):
                continue
            if not child.name.startswith("_"):
                visit(child, f"{name}.{child.name}")

    for path in python_files(root):
        visit(tree_of(path), path.relative_to(root).as_posix())
    return offences
