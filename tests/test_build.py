"""The build: targets of the Makefile, prerequisites, and the contents of a wheel."""

from __future__ import annotations

import os
import subprocess
import tomllib
from pathlib import Path

import pytest
from support.patience import PATIENCE

ROOT = Path(__file__).resolve().parent.parent
PREREQUISITES = ROOT / ".ci" / "prerequisites"


def make(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["make", *words], cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE)


def test_make_without_a_target_lists_the_targets() -> None:
    out = make("help").stdout
    for target in ("demo", "test", "lint", "bench", "docs", "wheel", "clean"):
        assert f"make {target}" in out


@pytest.fixture
def tools(tmp_path: Path) -> Path:
    """A PATH with the machine's shell tools, and stand-ins for the checked programs."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name in ("bash", "sed", "sort", "head", "printf", "printenv", "mkdir", "rm", "cut", "dirname", "env"):
        for place in ("/usr/bin", "/bin"):
            if Path(place, name).exists():
                (folder / name).symlink_to(Path(place, name))
                break
    stand_in(folder, "python3", "echo 3.13.1")
    stand_in(folder, "cc", "true")
    stand_in(folder, "rustc", "echo rustc 1.95.0")
    stand_in(folder, "cargo", "true")
    stand_in(folder, "cargo-fmt", "true")
    stand_in(folder, "cargo-clippy", "true")
    return folder


def stand_in(folder: Path, name: str, line: str) -> None:
    path = folder / name
    path.unlink(missing_ok=True)
    path.write_text(f"#!/bin/bash\n{line}\n")
    path.chmod(0o755)


def check(tools: Path) -> str:
    """The messages of the check on stderr."""
    done = subprocess.run(
        [str(tools / "bash"), str(PREREQUISITES), str(tools.parent / "venv")],
        cwd=ROOT,
        env={"PATH": str(tools), "HOME": os.environ.get("HOME", "/")},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    return done.stderr


@pytest.mark.parametrize(
    ("broken", "line", "words"),
    [
        ("python3", None, "Python >= 3.11; python3 not found"),
        ("python3", "echo 3.10.12", "Python >= 3.11; python3 is version 3.10.12"),
        ("cc", None, "a C compiler"),
        ("rustc", None, "Rust >= 1.89; rustc not found"),
        ("rustc", "echo rustc 1.63.0", "Rust >= 1.89; rustc is version 1.63.0"),
        ("cargo-fmt", None, "rustfmt in addition to rustc"),
        ("cargo-clippy", None, "clippy in addition to rustc"),
        ("python3", '[ "$1" = -m ] && exit 1; echo 3.13.1', "Python's venv module"),
    ],
)
def test_missing_prerequisite_is_reported_in_one_line(
    tools: Path, broken: str, line: str | None, words: str
) -> None:
    if line is None:
        (tools / broken).unlink()
    else:
        stand_in(tools, broken, line)
    said = check(tools)
    assert words in said
    assert said.count("\n") == 1
    assert said.startswith("raycam requires ")


def test_missing_rust_toolchain_is_installed_with_rustup(tools: Path) -> None:
    stand_in(tools, "rustc", '[ "$1" = +stable ] && echo rustc 1.90.0 || echo rustc 1.63.0')
    stand_in(tools, "rustup", 'echo "rustup $*" >&2')
    stand_in(tools, "python3", '[ "$1" = -m ] && mkdir -p "$3" || echo 3.13.1')
    assert "rustup toolchain install stable" in check(tools)
    assert "RUSTUP_TOOLCHAIN := stable" in (tools.parent / "venv" / "done" / "toolchain.mk").read_text()


def test_packages_share_one_version_and_one_rust_version() -> None:
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["dynamic"] == ["version"]
    import raycam

    assert raycam.__version__ == workspace["version"]
    for crate in ROOT.glob("crates/*/Cargo.toml"):
        package = tomllib.loads(crate.read_text())["package"]
        assert package["version"] == package["rust-version"] == {"workspace": True}


def test_wheels_use_no_machine_specific_instructions() -> None:
    manifest = tomllib.loads((ROOT / "Cargo.toml").read_text())
    assert "abi3-py311" in manifest["workspace"]["dependencies"]["pyo3"]["features"]
    settings = (
        [path for path in (ROOT / ".cargo").rglob("*") if path.is_file()]
        if (ROOT / ".cargo").exists()
        else []
    )
    for path in [ROOT / "Makefile", ROOT / "pyproject.toml", ROOT / "Cargo.toml", *settings]:
        assert "target-cpu" not in path.read_text(), path
    assert manifest["profile"]["release"].get("panic", "unwind") == "unwind"


def test_ci_runs_make_test() -> None:
    script = ROOT / ".ci" / "run"
    assert os.access(script, os.X_OK)
    assert "make test" in script.read_text()


def test_client_type_check_is_skipped_with_a_message_unless_required(tools: Path) -> None:
    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [str(tools / "bash"), str(ROOT / ".ci" / "client"), str(tools.parent / "venv"), *words],
            env={"PATH": str(tools)},
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )

    left_out, failed = run(), run("needed")
    assert (left_out.returncode, failed.returncode) == (0, 1)
    assert left_out.stdout == failed.stdout
    assert "skipping the check of the client's types: node not found" in left_out.stdout

    stand_in(tools, "node", "true")
    stand_in(tools, "npm", "exit 1")
    assert "npm cannot download typescript@" in run().stdout

    made = tools.parent / "venv" / "typescript-5.9.3" / "node_modules" / "typescript" / "bin"
    made.mkdir(parents=True)
    (made / "tsc").touch()
    stand_in(tools, "node", 'echo "$*"; exit 2')
    wrong = run()
    assert wrong.returncode == 2
    assert "--checkJs --strict" in wrong.stdout
