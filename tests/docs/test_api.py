"""The list of the Python reference, which contains every public name."""

from __future__ import annotations

from pathlib import Path

import pytest
import raycam

DOCS = Path(__file__).resolve().parents[2] / "docs"
DATA = {"FORMATS", "__version__"}
"""Public names that are neither functions nor classes."""


def test_reference_lists_every_public_function_and_class(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS))
    import api  # type: ignore[import-not-found]

    listed = {name for names in api.SECTIONS.values() for name in names}
    errors = set(api.named("errors").__all__)
    assert sorted(set(raycam.__all__) - listed - errors - DATA) == []
