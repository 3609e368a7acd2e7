"""Expected errors by class, code and facts, instead of by their wording."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest


@contextmanager
def raises(
    kind: type[BaseException], *, code: str | None = None, mentions: Iterable[object] = ()
) -> Iterator[pytest.ExceptionInfo[Any]]:
    """Expects an error of a class with this `code` whose text contains each of `mentions`, such as names and values."""
    with pytest.raises(kind) as caught:
        yield caught
    if code is not None:
        assert getattr(caught.value, "code", None) == code, caught.value
    missing = [str(fact) for fact in mentions if str(fact) not in str(caught.value)]
    assert not missing, f"{missing} not in {caught.value}"


def notice_codes(notices: Iterable[Any]) -> list[str]:
    """The codes of notices, in order."""
    return [notice.code for notice in notices]
