"""Errors of documents that no reader recognises because they are invalid."""

from __future__ import annotations

from pathlib import Path

import pytest
import raycam
from raycam.errors import FormatError
from support.raises import raises

K = "[[500, 0, 320], [0, 500, 240], [0, 0, 1]]"


@pytest.mark.parametrize(
    ("name", "text", "line", "fact"),
    [
        ("a.xml", '<camera K="500">\n<K>501</K>\n</camera>', 2, "attribute"),
        ("a.xml", "<camera>\n<K>500 0 320</K>\n", 1, "closed"),
        ("a.txt", "\n<camera><K>500 0 320</camera>", 2, "XML"),
        ("a.json", f'{{"K": {K},\n"size": [640, 480]', 3, "JSON"),
        ("a.txt", f'{{"K": {K},\n"size": [640, 480]', 3, "JSON"),
        ("a.yaml", f"K: {K}\nK: {K}\n", 2, "twice"),
        ("a.toml", f"[a]\nK = {K}\nK = {K}\n", 3, "duplicate"),
        ("a.cfg", f"K = {K}\nsize = [640, 480\n", 2, "TOML"),
    ],
)
def test_error_of_an_invalid_document_names_its_line(
    tmp_path: Path, name: str, text: str, line: int, fact: str
) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(FormatError) as caught:
        raycam.load_cameras(path)
    assert f"{name}:{line}:" in str(caught.value)
    assert fact in str(caught.value)
    assert "supported:" not in str(caught.value)


def test_text_in_another_language_has_an_unknown_format(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("shopping list\nmilk\n")
    with raises(FormatError, code="unsupported_feature", mentions=["supported:"]):
        raycam.load_cameras(path)
