"""Functions are at most 80 lines long."""

from __future__ import annotations

from pathlib import Path

from rules import functions

ROOT = Path(__file__).resolve().parents[2]


def test_functions_have_at_most_80_lines() -> None:
    assert functions.long_functions(ROOT) == []


def test_long_function_is_reported(tmp_path: Path) -> None:
    source = tmp_path / "crates" / "bvh" / "src"
    package = tmp_path / "python" / "raycam"
    source.mkdir(parents=True)
    package.mkdir(parents=True)
    body = "    f();\n" * 78
    (source / "lib.rs").write_text(
        f"fn short() {{\n{body}}}\n/// Documented.\nfn long() {{\n    f();\n{body}}}\n"
        f"#[cfg(test)]\nmod tests {{ fn test() {{\n{body}{body}}} }}\n"
    )
    docstring = f'    """Documented.\n\n{body}    """\n'
    (package / "a.py").write_text(
        f"def f():\n{docstring}" + "    g()\n" * 80 + f"def h():\n{docstring}    g()\n"
    )
    assert functions.long_functions(tmp_path) == [
        "crates/bvh/src/lib.rs: long has 81 lines",
        "python/raycam/a.py: f has 81 lines",
    ]
