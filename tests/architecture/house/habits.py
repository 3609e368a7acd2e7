"""Habits: public Python is documented, and what a crate offers is tested."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from .python_imports import tree_of
from .rust_imports import read_crate, resolved
from .source import code_of, crates, python_files, text_of

# Without behaviour of their own: error texts and version, tested where they are used.
PLAIN = {"error", "errors", "limits", "__init__", "__main__"}


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


def exported_files(source: Path) -> list[Path]:
    """Files that define what a crate's `lib.rs` shows to others."""
    crate = read_crate(source)
    files = {resolved(crate, name) for name in crate.public_bindings}
    public = re.findall(r"^pub mod (\w+)", text_of(crate.file), re.M)
    files |= {crate.children[name].file for name in public if name in crate.children}
    return sorted(file for file in files if isinstance(file, Path) and file != crate.file)


def untested_rust(root: Path) -> list[str]:
    """Files of a crate's public items that no test names: not inline, nor by file name, nor by item."""
    offences = []
    for crate in crates(root):
        if crate == "bindings":
            continue
        folder = root / "crates" / crate
        tests = sorted((folder / "tests").rglob("*.rs")) + sorted((folder / "src").rglob("tests/*.rs"))
        words = set(re.findall(r"\w+", " ".join(code_of(path) for path in tests))) | {
            path.stem for path in tests
        }
        for path in exported_files(folder / "src"):
            text = text_of(path)
            concept = path.parent.name if path.stem == "mod" else path.stem
            items = set(re.findall(r"^\s*pub (?:fn|struct|enum|trait) (\w+)", text, re.M)) | {concept}
            if concept not in PLAIN and "#[cfg(test)]" not in text and not items & words:
                offences.append(f"{path.relative_to(root)} has no test")
    return offences


def untested_python(root: Path) -> list[str]:
    """Files of the package without tests in a folder, or in a file, of their name."""
    tests = {path.stem.removeprefix("test_") for path in (root / "tests").glob("test_*.py")}
    tests |= {path.parent.name for path in (root / "tests").glob("*/test_*.py")}
    package = root / "python" / "raycam"
    offences = []
    for path in python_files(root):
        place = path.relative_to(package)
        concept = place.parts[0].removesuffix(".py").removeprefix("_")
        if path.stem not in PLAIN and concept not in tests and not is_entry_point(path):
            offences.append(f"{path.relative_to(root)} has no test of its name")
    return offences


def is_entry_point(path: Path) -> bool:
    """True of a file that only starts another module for `python -m`."""
    return not any(isinstance(node, ast.FunctionDef | ast.ClassDef) for node in tree_of(path).body)
