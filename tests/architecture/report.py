"""Prints the state of the source tree: import cycles, upward imports, long functions, sizes.

Requires cargo, because a tool in `rust_facts` parses the Rust sources:

    python3 tests/architecture/report.py                 counts for this repository
    python3 tests/architecture/report.py --list          each finding, too
    python3 tests/architecture/report.py --root DIR      another repository
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from rules import functions, graph, layout, python_imports, rust_facts

FIGURES: dict[str, Callable[[Path], list[str]]] = {
    "functions over 80 lines": functions.long_functions,
    "files over 700 lines": functions.large_files,
    "folders over 16 files": functions.large_folders,
}


def cycle_lines(arrows: graph.Arrows) -> list[str]:
    """One text per cycle: its files, and their imports within the cycle."""
    lines = []
    for cycle in graph.circles(arrows):
        imports = [f"{name} -> {', '.join(sorted(arrows[name] & set(cycle)))}" for name in cycle]
        lines.append(f"{len(cycle)} files\n        " + "\n        ".join(imports))
    return lines


def show(title: str, findings: list[str], *, each: bool) -> None:
    """Prints the number of findings, and each of them on request."""
    print(f"{len(findings):5}  {title}")
    for finding in findings if each else ():
        print(f"      {finding}")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--root", type=Path, default=Path(__file__).resolve().parents[2])
    parser.add_argument("--list", action="store_true", help="print each finding")
    options = parser.parse_args()
    root = options.root.resolve()
    parts = {crate: rust_facts.imports(root, crate) for crate in rust_facts.crates(root)}
    parts["python"] = python_imports.arrows(root / "python" / "raycam")
    for part, arrows in parts.items():
        show(f"{part}: import cycles", cycle_lines(arrows), each=options.list)
        upward = graph.upward_arrows(arrows, layout.order_of(part))
        show(f"{part}: imports against the order of folders", upward, each=options.list)
    for title, figure in FIGURES.items():
        show(title, figure(root), each=options.list)


if __name__ == "__main__":
    main()
