"""Prints the figures of the source tree: circles, arrows, sizes, names.

Plain Python without dependencies:

    python3 tests/architecture/report.py                     figures of this repository
    python3 tests/architecture/report.py --list              each offence, too
    python3 tests/architecture/report.py --root DIR --crate bvh --crate python
"""

from __future__ import annotations

import argparse
from pathlib import Path

from house import graph, layout, names, python_imports, rust_imports, size
from house.source import crates


def crate_figures(root: Path, crate: str) -> dict[str, list[str]]:
    """Offences of a crate, by what they offend against."""
    arrows = rust_imports.arrows(root / "crates" / crate / "src")
    return {
        "circles of files": circle_lines(arrows),
        "arrows that run up, files without a place": graph.upward_arrows(arrows, layout.order_of(crate)),
        "functions over 80 lines": size.long_rust_functions(root, crate),
        "types with the same name": names.repeated_types(root, crate),
    }


def python_figures(root: Path) -> dict[str, list[str]]:
    """Offences of the Python package, by what they offend against."""
    arrows = python_imports.arrows(root / "python" / "raycam")
    return {
        "circles of files": circle_lines(arrows),
        "arrows that run up, files without a place": graph.upward_arrows(arrows, layout.order_of("python")),
        "functions over 80 lines": size.long_python_functions(root),
    }


def house_figures(root: Path) -> dict[str, list[str]]:
    """Offences that no one crate answers for."""
    return {
        "folders over 16 files": size.full_folders(root),
        "files over 700 lines": size.long_files(root),
        "names that say nothing": names.vague_names(root),
    }


def circle_lines(arrows: graph.Arrows) -> list[str]:
    """One line a circle: its files, and the arrows that tie them."""
    lines = []
    for circle in graph.circles(arrows):
        ties = [f"{name} -> {', '.join(sorted(arrows[name] & set(circle)))}" for name in circle]
        lines.append(f"{len(circle)} files\n        " + "\n        ".join(ties))
    return lines


def show(title: str, figures: dict[str, list[str]], *, each: bool) -> None:
    """Prints a count for every kind of offence, and each offence where asked."""
    print(title)
    for kind, offences in figures.items():
        print(f"  {len(offences):5}  {kind}")
        for offence in offences if each else ():
            print(f"      {offence}")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--root", type=Path, default=Path(__file__).resolve().parents[2], help="another repository"
    )
    parser.add_argument("--crate", action="append", help="only this crate, or `python`; may be repeated")
    parser.add_argument("--list", action="store_true", help="print each offence")
    chosen = parser.parse_args()
    root = chosen.root.resolve()
    for crate in chosen.crate or [*crates(root), "python"]:
        figures = python_figures(root) if crate == "python" else crate_figures(root, crate)
        show(crate, figures, each=chosen.list)
    if not chosen.crate:
        show("house", house_figures(root), each=chosen.list)


if __name__ == "__main__":
    main()
