"""Facts about Rust sources, from the tool `rust_facts`, which parses them with `syn`."""

from __future__ import annotations

import json
import subprocess
from functools import cache
from pathlib import Path
from typing import TypedDict

TOOL = Path(__file__).resolve().parents[1] / "rust_facts"
TARGET = Path(__file__).resolve().parents[3] / "target" / "rust_facts"


class FileFacts(TypedDict):
    """Facts about a file.

    `words` contains all identifiers of the file; the other lists omit items that are compiled for tests only.
    """

    words: list[str]
    types: list[str]
    functions: list[tuple[str, int]]
    matched: list[str]
    macros: list[tuple[str, str]]


class CrateFacts(TypedDict):
    """Facts about a crate: its files by path, and the imports between the files under `src`."""

    files: dict[str, FileFacts]
    imports: dict[str, list[str]]


@cache
def crates(root: Path) -> dict[str, CrateFacts]:
    """Facts about the crates under `root/crates`, by name. Requires cargo."""
    command = ["cargo", "run", "-q", "--locked", "--manifest-path", str(TOOL / "Cargo.toml")]
    command += ["--target-dir", str(TARGET), "--", str(root)]
    found = subprocess.run(command, capture_output=True, text=True)
    if found.returncode:
        raise RuntimeError(f"rust_facts failed:\n{found.stderr}")
    facts: dict[str, CrateFacts] = json.loads(found.stdout)
    return facts


def imports(root: Path, crate: str) -> dict[str, set[str]]:
    """For each file under `src`, the files whose definitions it names."""
    return {name: set(targets) for name, targets in crates(root)[crate]["imports"].items()}


def files(root: Path) -> dict[str, FileFacts]:
    """Facts about every file of every crate, by path from `root`."""
    return {name: facts for crate in crates(root).values() for name, facts in crate["files"].items()}


def is_source(name: str) -> bool:
    """True for files under `src` that are not test modules."""
    parts = Path(name).with_suffix("").parts
    return parts[2] == "src" and "tests" not in parts
