"""The house rules, read from the source: which room may use which, where `unsafe` and Python may be.

Every rule is a function from the repository root to a list of offences. Each is run on this repository, where
it must find none, and on a small house built to break it, where it must find some.
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

# A room may use the rooms listed; a sixth room needs an argument in docs/decisions.md.
ROOMS = {
    "bvh": set(),
    "scene": set(),
    "formats": {"scene"},
    "render": {"scene", "bvh"},
    "bindings": {"formats", "render", "scene"},
}
THIRD_PARTY_PYTHON = {
    "numpy",
    "rich",
    "av",
    "dask",
    "distributed",
    "pxr",
    "pyoidn",
    "cv2",
    "embreex",
    "websockets",
}
# Imported where it is needed: for what must be a class of another package, or is a process of its own.
IMPORTED_LATE = {
    "dask_worker.py",
    *(
        "usd_camera.py",
        "usd_instancer.py",
        "usd_solids.py",
        "usd_lights.py",
        "usd_materials.py",
        "usd_meshes.py",
        "usd_worker.py",
    ),
}
LONGEST_FILE = 400
# Generated or typed-in tables, whose length says nothing about how much there is to understand.
TABLES = {"crates/render/src/sampler/sobol_table.rs"}
VAGUE_NAMES = {"util", "utils", "helper", "helpers", "common", "misc", "stuff"}
# Without behaviour of their own: error texts and re-exports, tested where they are used.
PLAIN_RUST = {"error"}
PLAIN_PYTHON = {"__init__", "__main__", "errors"}


def rust_files(root: Path, room: str) -> Iterator[Path]:
    """All Rust source of a room, its tests, examples and benchmarks included."""
    for path in sorted((root / "crates" / room).rglob("*.rs")):
        if "target" not in path.relative_to(root).parts:
            yield path


def python_files(root: Path) -> list[Path]:
    return sorted((root / "python" / "raycam").rglob("*.py"))


NOT_CODE = re.compile(
    r"""
      //[^\n]* | /\*.*?\*/                # comments
    | r(\#*)".*?"\1 | "(?:\\.|[^"\\])*"   # strings
    | '(?:\\.[^']*|[^'\\])'              # characters, but not lifetimes
    """,
    re.S | re.X,
)


def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def code_of(path: Path) -> str:
    """Rust source without comments and the insides of strings and characters."""
    return NOT_CODE.sub(lambda m: " " if m[0].startswith("/") else '""', text_of(path))


def without_tests(path: Path) -> str:
    """Rust source up to its inline tests, which stand at the end of a file."""
    return re.split(r"^#\[cfg\(test\)\]\s*\nmod \w+ \{", text_of(path), maxsplit=1, flags=re.M)[0]


def manifest(root: Path, room: str) -> dict[str, object]:
    return tomllib.loads(text_of(root / "crates" / room / "Cargo.toml"))


def dependencies(table: dict[str, object]) -> set[str]:
    """Names in every dependency table of a manifest: normal, for tests, for builds, per target."""
    names = set()
    for key, value in table.items():
        if isinstance(value, dict):
            names |= set(value) if key.endswith("dependencies") else dependencies(value)
    return names


def is_for_types(node: ast.AST) -> bool:
    """Whether it is an `if TYPE_CHECKING:`, whose imports never happen."""
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def imports(path: Path, *, top_level_only: bool = False) -> set[str]:
    """The packages that a Python file imports; relative imports are named with a leading dot."""
    body = [node for node in ast.parse(text_of(path)).body if not is_for_types(node)]
    found = set()
    walk = (inner for node in body for inner in ast.walk(node))
    for node in body if top_level_only else walk:
        if isinstance(node, ast.Import):
            found |= {name.name.split(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level:
            found |= {f".{node.module or name.name}" for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add((node.module or "").split(".")[0])
    return found


# The rules ------------------------------------------------------------------------------------------------


def strange_rooms(root: Path) -> list[str]:
    """The rooms are the five that design and decisions know."""
    there = {path.parent.name for path in (root / "crates").glob("*/Cargo.toml")}
    return sorted(f"crates/{name} is not a room of this house" for name in there ^ set(ROOMS))


def manifests_that_reach(root: Path) -> list[str]:
    """A manifest names only rooms that its room may use, for its tests too."""
    return [
        f"crates/{room}/Cargo.toml depends on {name}"
        for room, allowed in ROOMS.items()
        for name in sorted(dependencies(manifest(root, room)))
        if name.startswith("raycam") and name.removeprefix("raycam-") not in allowed
    ]


def sources_that_reach(root: Path) -> list[str]:
    """Source names only rooms that its room may use, and includes no file from outside its room."""
    offences = []
    for room, allowed in ROOMS.items():
        for path in rust_files(root, room):
            for name in sorted(set(re.findall(rf"\braycam_({'|'.join(ROOMS)})\b", code_of(path)))):
                if name not in allowed | {room}:
                    offences.append(f"{path.relative_to(root)} uses raycam_{name}")
            text = text_of(path)
            for quoted in re.findall(r'(?:#\[path\s*=\s*|include(?:_str|_bytes)?!\(\s*)"([^"]+)"', text):
                if not (path.parent / quoted).resolve().is_relative_to(root.resolve() / "crates" / room):
                    offences.append(f"{path.relative_to(root)} includes {quoted}")
    return offences


def unsafe_outside_bvh(root: Path) -> list[str]:
    """`unsafe` is bvh's alone; the other rooms forbid it to themselves."""
    offences = []
    for room in sorted(set(ROOMS) - {"bvh"}):
        if "#![forbid(unsafe_code)]" not in text_of(root / "crates" / room / "src" / "lib.rs"):
            offences.append(f"crates/{room}/src/lib.rs does not forbid unsafe_code")
        for path in rust_files(root, room):
            if re.search(r"\bunsafe\b", code_of(path)):
                offences.append(f"{path.relative_to(root)} says unsafe")
    return offences


def python_outside_bindings(root: Path) -> list[str]:
    """Only bindings knows that Python exists."""
    offences = []
    for room in sorted(set(ROOMS) - {"bindings"}):
        for name in sorted(dependencies(manifest(root, room)) & {"pyo3", "numpy"}):
            offences.append(f"crates/{room}/Cargo.toml depends on {name}")
        for path in rust_files(root, room):
            if re.search(r"\b(pyo3|numpy)::", code_of(path)):
                offences.append(f"{path.relative_to(root)} uses Python")
    return offences


def oracle_that_shares(root: Path) -> list[str]:
    """The oracle is an independent witness: NumPy and the standard library, nothing of ours but itself."""
    allowed = {"numpy", ".reference_units"} | set(sys.stdlib_module_names)
    return [
        f"{name} imports {found}"
        for name in ("reference.py", "reference_units.py")
        if (root / "python" / "raycam" / name).exists()
        for found in sorted(imports(root / "python" / "raycam" / name) - allowed)
    ]


def unknown_python_packages(root: Path) -> list[str]:
    """The package imports what pyproject.toml installs; what is slow to import, only where it is used."""
    offences = []
    for path in python_files(root):
        own = {name for name in imports(path) if name.startswith(".") or name == "raycam"}
        for name in sorted(imports(path) - own - set(sys.stdlib_module_names) - THIRD_PARTY_PYTHON):
            offences.append(f"{path.relative_to(root)} imports {name}")
        early = set() if path.name in IMPORTED_LATE else imports(path, top_level_only=True)
        for name in sorted(early & (THIRD_PARTY_PYTHON - {"numpy"})):
            offences.append(f"{path.relative_to(root)} imports {name} at the top, which delays every start")
    return offences


def long_files(root: Path) -> list[str]:
    """A file is short enough to be read in one sitting; inline tests do not count."""
    offences = []
    rust = [path for room in ROOMS for path in rust_files(root, room)]
    rust = [path for path in rust if "tests" not in path.relative_to(root).parts]
    for path in [*rust, *python_files(root), *sorted((root / "benchmarks").glob("*.py"))]:
        name = path.relative_to(root).as_posix()
        lines = without_tests(path).count("\n")
        if lines > LONGEST_FILE and name not in TABLES:
            offences.append(f"{name} has {lines} lines, above {LONGEST_FILE}")
    return offences


def vague_names(root: Path) -> list[str]:
    """A file is named after its concept."""
    paths = [path for room in ROOMS for path in (root / "crates" / room / "src").rglob("*.rs")]
    return [
        f"{path.relative_to(root)} has a name that says nothing"
        for path in sorted(paths) + python_files(root)
        if VAGUE_NAMES & {path.stem, *path.relative_to(root).parts}
    ]


def undocumented_python(root: Path) -> list[str]:
    """Every public module, class, function, method and property tells what it is."""
    offences = []

    def visit(node: ast.AST, name: str) -> None:
        if not ast.get_docstring(node):  # type: ignore[arg-type]
            offences.append(f"{name} has no docstring")
        if isinstance(node, ast.Module | ast.ClassDef):
            for child in node.body:
                if isinstance(child, ast.ClassDef | ast.FunctionDef) and not child.name.startswith("_"):
                    visit(child, f"{name}.{child.name}")

    for path in python_files(root):
        visit(ast.parse(text_of(path)), f"raycam.{path.stem}")
    return offences


def exported(folder: Path) -> Iterator[tuple[str, list[Path]]]:
    """The modules that a room's lib.rs shows to others, with their files; the rest is how they do it."""
    for module in sorted(
        set(re.findall(r"^pub (?:mod|use) (\w+)", text_of(folder / "src" / "lib.rs"), re.M))
    ):
        files = [folder / "src" / f"{module}.rs", *sorted((folder / "src" / module).rglob("*.rs"))]
        yield module, [path for path in files if path.exists()]


def untested_concepts(root: Path) -> list[str]:
    """What a room offers is tested under its name: inline, by a test file called so, or by one that names it."""
    offences = []
    for room in sorted(set(ROOMS) - {"bindings"}):
        folder = root / "crates" / room
        files_of_tests = sorted((folder / "tests").rglob("*.rs"))
        words = set(re.findall(r"\w+", " ".join(code_of(path) for path in files_of_tests)))
        words |= {path.stem for path in files_of_tests}
        for module, files in exported(folder):
            text = "\n".join(text_of(path) for path in files)
            items = set(re.findall(r"^\s*pub (?:fn|struct|enum|trait) (\w+)", text, re.M)) | {module}
            if files and module not in PLAIN_RUST and "#[cfg(test)]" not in text and not items & words:
                offences.append(f"crates/{room} has no test of {module}")
    tests = {path.stem.removeprefix("test_") for path in (root / "tests").rglob("test_*.py")}
    for path in python_files(root):
        # `explain_figure` may be tested where `explain` is, `cli/options` where `cli` is.
        if not {path.stem, path.stem.split("_")[0], path.parent.name} & (tests | PLAIN_PYTHON):
            offences.append(f"{path.relative_to(root)} has no test of its name")
    return offences


RULES: list[Callable[[Path], list[str]]] = [
    strange_rooms,
    manifests_that_reach,
    sources_that_reach,
    unsafe_outside_bvh,
    python_outside_bindings,
    oracle_that_shares,
    unknown_python_packages,
    long_files,
    vague_names,
    undocumented_python,
    untested_concepts,
]


@pytest.fixture(scope="module")
def broken_house(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A house where every rule is broken once."""
    root = tmp_path_factory.mktemp("house")

    def write(name: str, text: str) -> None:
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    for room in ROOMS:
        write(f"crates/{room}/Cargo.toml", f'[package]\nname = "raycam-{room}"\n')
        write(f"crates/{room}/src/lib.rs", "#![forbid(unsafe_code)]\n")
    write("crates/kitchen/Cargo.toml", "[package]\n")
    write(
        "crates/bvh/Cargo.toml", "[target.x.dev-dependencies]\nraycam-scene = {}\n[dependencies]\npyo3 = {}\n"
    )
    write("crates/scene/src/lib.rs", "pub fn f() { unsafe { g() } }\n")
    write("crates/formats/src/lib.rs", "pub mod obj;\n")
    write("crates/formats/src/obj.rs", 'use raycam_render::Frame;\ninclude!("../../scene/src/lib.rs");\n')
    write("crates/render/src/common.rs", "// nothing\n" * (LONGEST_FILE + 1))
    write("python/raycam/__init__.py", "import pandas\nimport rich\ndef f(): ...\n")
    write("python/raycam/reference.py", '"""Text."""\nfrom . import _core\nfrom raycam import world\n')
    return root


@pytest.mark.parametrize("rule", RULES)
def test_this_house_keeps_the_rule(rule: Callable[[Path], list[str]]) -> None:
    assert rule(ROOT) == []


@pytest.mark.parametrize("rule", RULES)
def test_a_broken_house_is_noticed(rule: Callable[[Path], list[str]], broken_house: Path) -> None:
    assert rule(broken_house) != []


def test_comments_and_strings_are_not_code(tmp_path: Path) -> None:
    path = tmp_path / "a.rs"
    path.write_text(
        """// unsafe
        /* unsafe */ let a = "unsafe \\" unsafe"; let c = '"';
        let b = r#"unsafe " unsafe"#; let d: &'a str = "unsafe";
        """
    )
    assert "unsafe" not in code_of(path)
    assert "let b" in code_of(path)
