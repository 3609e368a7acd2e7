"""Boundaries: which crates, languages and packages may use each other."""

from __future__ import annotations

import re
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

from . import rust_facts
from .python_imports import imported_packages
from .source import CRATES, python_files, text_of

# Crates that each crate may use. Another crate must be justified in the design notes.
MAY_USE: dict[str, set[str]] = {
    "bvh": set(),
    "scene": set(),
    "formats": {"scene"},
    "calibration": {"scene", "formats"},
    "render": {"scene", "bvh"},
    "settle": {"scene"},
    "web": {"formats", "render", "scene"},
    "bindings": {"formats", "calibration", "render", "scene", "settle"},
}
THIRD_PARTY_PYTHON = {
    "numpy",
    "av",
    "dask",
    "distributed",
    "mcap",
    "collada",
    "xacro",
    "yaml",
    "mujoco",
    "xatlas",
    "pxr",
    "cairosvg",
    "pyoidn",
    "cv2",
    "embreex",
    "anywidget",
    "traitlets",
    "websockets",
}
# These packages are imported only when needed, so they may import slow packages at the top of a file.
IMPORTED_LATE = ("usd/", "robots/xacro_worker.py", "cluster/dask_worker.py")


def manifest(root: Path, crate: str) -> dict[str, object]:
    return tomllib.loads(text_of(root / "crates" / crate / "Cargo.toml"))


def dependencies(table: dict[str, object]) -> set[str]:
    """Names in every dependency table of a manifest: normal, for tests, for builds, per target."""
    found = set()
    for key, value in table.items():
        if isinstance(value, dict):
            found |= set(value) if key.endswith("dependencies") else dependencies(value)
    return found


def unlisted_crates(root: Path) -> list[str]:
    """Crates that are missing in `CRATES`, and listed crates that do not exist."""
    found = {path.parent.name for path in (root / "crates").glob("*/Cargo.toml")}
    return sorted(f"crates/{name}: the folders and the list of crates differ" for name in found ^ set(CRATES))


def forbidden_dependencies(root: Path) -> list[str]:
    """Manifests with a forbidden dependency on another crate, including dependencies of tests."""
    return [
        f"crates/{crate}/Cargo.toml depends on {name}"
        for crate, allowed in MAY_USE.items()
        for name in sorted(dependencies(manifest(root, crate)))
        if name.startswith("raycam") and name.removeprefix("raycam-") not in allowed
    ]


def forbidden_uses(root: Path) -> list[str]:
    """Rust files that use a forbidden crate, or include a file from outside their crate."""
    offences = []
    for crate, allowed in MAY_USE.items():
        others = {f"raycam_{name}" for name in set(CRATES) - allowed - {crate}}
        for file, facts in rust_facts.crates(root)[crate]["files"].items():
            offences += [f"{file} uses {name}" for name in sorted(others & set(facts["words"]))]
            for _, quoted in facts["macros"]:
                included = ((root / file).parent / quoted).resolve()
                if not included.is_relative_to(root.resolve() / "crates" / crate):
                    offences.append(f"{file} includes {quoted}")
    return offences


def unsafe_outside_bvh(root: Path) -> list[str]:
    """Uses of `unsafe` outside bvh, and other crates without `forbid(unsafe_code)`."""
    offences = []
    for crate in sorted(set(CRATES) - {"bvh"}):
        if "#![forbid(unsafe_code)]" not in text_of(root / "crates" / crate / "src" / "lib.rs"):
            offences.append(f"crates/{crate}/src/lib.rs does not forbid unsafe_code")
        files = rust_facts.crates(root)[crate]["files"]
        offences += [f"{file} uses unsafe" for file, facts in files.items() if "unsafe" in facts["words"]]
    return offences


def python_outside_bindings(root: Path) -> list[str]:
    """Crates other than bindings that depend on Python."""
    return [
        f"crates/{crate}/Cargo.toml depends on {name}"
        for crate in sorted(set(CRATES) - {"bindings"})
        for name in sorted(dependencies(manifest(root, crate)) & {"pyo3", "numpy"})
    ]


def shared_code_of_reference(root: Path) -> list[str]:
    """Forbidden imports of `raycam.reference`.

    It may import only NumPy and the standard library.
    """
    allowed = {"numpy", ".units", ".procedure", ".picture"} | set(sys.stdlib_module_names)
    return [
        f"{path.relative_to(root)} imports {found}"
        for path in sorted((root / "python" / "raycam" / "reference").glob("*.py"))
        for found in sorted(imported_packages(path) - allowed)
    ]


def unknown_python_packages(root: Path) -> list[str]:
    """Imports of undeclared packages, and imports of slow packages at the top of a file.

    Undeclared packages are missing in pyproject.toml.
    """
    offences = []
    for path in python_files(root):
        own = {name for name in imported_packages(path) if name.startswith(".") or name == "raycam"}
        known = own | set(sys.stdlib_module_names) | THIRD_PARTY_PYTHON
        for name in sorted(imported_packages(path) - known):
            offences.append(f"{path.relative_to(root)} imports {name}")
        if not path.relative_to(root / "python" / "raycam").as_posix().startswith(IMPORTED_LATE):
            early = imported_packages(path, top_level_only=True)
            for name in sorted(early & (THIRD_PARTY_PYTHON - {"numpy"})):
                offences.append(
                    f"{path.relative_to(root)} imports {name} at the top, which delays every start"
                )
    return offences


def compat_that_reaches_in(root: Path) -> list[str]:
    """Forbidden imports between the package and its stand-ins for other libraries.

    A stand-in must not import private names of the package, and the package must not import a stand-in. The
    stand-ins may also import the sRGB transfer function, which is a formula without state.
    """
    package = root / "python" / "raycam"
    offences = []
    for path in python_files(root):
        inside = path.is_relative_to(package / "compat")
        for name in re.findall(r"^\s*(?:from|import)\s+([.\w]+)", text_of(path), re.MULTILINE):
            private = name.startswith("raycam.") or re.match(
                rf"\.{{{len(path.relative_to(package).parts)},}}", name
            )
            if inside and private and not name.startswith(("raycam.compat", "raycam.srgb")):
                offences.append(f"{path.relative_to(root)} imports {name}; expected names of raycam itself")
            if not inside and re.search(r"(^|\.)compat\b", name):
                offences.append(f"{path.relative_to(root)} imports {name}, which is for users alone")
    return offences


def undeclared_python_packages(root: Path) -> list[str]:
    """Packages that tests import although pyproject.toml does not list them."""
    manifest = tomllib.loads(text_of(root / "pyproject.toml"))
    project = manifest["project"]
    lines = [*project["dependencies"], *manifest["dependency-groups"]["test"]]
    lines += [line for extra in project["optional-dependencies"].values() for line in extra]
    declared = {re.split(r"[^\w.-]", line, maxsplit=1)[0].lower() for line in lines}
    installed = packages_distributions()
    beside = [
        path for folder in ("tests", "tests/architecture", "docs") for path in (root / folder).glob("*")
    ]
    known = {path.stem for path in beside} | {"raycam", "tests"} | set(sys.stdlib_module_names)
    offences = []
    for path in sorted((root / "tests").rglob("*.py")):
        for name in sorted(imported_packages(path) - known):
            distributions = {found.lower() for found in installed.get(name, [name])}
            if not name.startswith(".") and not distributions & declared:
                offences.append(
                    f"{path.relative_to(root)} imports {name}, which pyproject.toml does not install"
                )
    return offences
