"""The table of codes contains exactly the codes that errors and notices use.

Every code has a cause and a remedy.
"""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

from raycam import codes

REPOSITORY = Path(__file__).parent.parent
NOTICE_CALLS = {"Notice": 1, "StageNotice": 0, "_note": 0}
"""Functions that create notices, and the position of the code among their arguments."""


@cache
def calls_in_python() -> list[ast.Call]:
    found = []
    for path in (REPOSITORY / "python" / "raycam").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                found.append(node)
    return found


def notice_codes_in_python() -> set[str]:
    found = set()
    for call in calls_in_python():
        name = getattr(call.func, "id", getattr(call.func, "attr", None))
        place = NOTICE_CALLS.get(str(name))
        if place is not None and len(call.args) > place:
            nodes = ast.walk(call.args[place])
            found |= {str(node.value) for node in nodes if isinstance(node, ast.Constant)}
    return found


def error_codes_in_python() -> set[str]:
    from raycam import errors

    found = {kind.code for kind in vars(errors).values() if isinstance(kind, type) and hasattr(kind, "code")}
    for call in calls_in_python():
        for keyword in call.keywords:
            if keyword.arg == "code" and isinstance(keyword.value, ast.Constant):
                found.add(str(keyword.value.value))
    return found


def codes_of_settling() -> set[str]:
    """The codes of crates/settle, which does not use the table."""
    text = (REPOSITORY / "crates" / "settle" / "src" / "error.rs").read_text(encoding="utf-8")
    return set(re.findall(r'=> "(\w+)"', text))


def codes_in_rust(table: str) -> set[str]:
    """The codes that the crates use, apart from the definition of the table."""
    text = "".join(
        path.read_text(encoding="utf-8")
        for path in (REPOSITORY / "crates").glob("*/src/**/*.rs")
        if path.name not in ("notice.rs", "error_code.rs")
    )
    variants = re.findall(rf"\b{table}::([A-Z]\w*[a-z]\w*)", text)
    return {re.sub(r"(?<!^)(?=[A-Z])", "_", variant).lower() for variant in variants}


def test_codes_of_notices_equal_the_table() -> None:
    assert sorted(notice_codes_in_python() | codes_in_rust("NoticeCode")) == sorted(codes.NOTICES)


def test_codes_of_errors_equal_the_table() -> None:
    used = error_codes_in_python() | codes_in_rust("ErrorCode") | codes_of_settling()
    assert sorted(used) == sorted(codes.ERRORS)


def test_causes_and_remedies_are_sentences() -> None:
    for name, code in (codes.NOTICES | codes.ERRORS).items():
        assert re.fullmatch(r"[a-z]+(_[a-z]+)*", name)
        assert code.cause.endswith("."), name
        assert code.remedy.endswith("."), name
