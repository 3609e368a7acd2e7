"""Expected errors by class, code and facts, instead of by their wording."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TypedDict

import pytest


class Fault(TypedDict):
    """The arguments of `raises` that describe an expected error."""

    code: str | None
    mentions: list[str]


def fault(code: str | None, *mentions: str) -> Fault:
    """An expected error in a table of tests: `raises(kind, **fault(code, ...))`."""
    return Fault(code=code, mentions=list(mentions))


@contextmanager
def raises(
    kind: type[BaseException] | tuple[type[BaseException], ...],
    *,
    code: str | None = None,
    mentions: Iterable[object] = (),
) -> Iterator[pytest.ExceptionInfo[Any]]:
    """Expects an error with this class and `code` whose text contains all `mentions`.

    Mentions are, for example, names and values.
    """
    with pytest.raises(kind) as caught:
        yield caught
    if code is not None:
        assert getattr(caught.value, "code", None) == code, caught.value
    check_mentions(str(caught.value), mentions)


@contextmanager
def warns(
    kind: type[Warning], *, code: str | None = None, mentions: Iterable[object] = ()
) -> Iterator[pytest.WarningsRecorder]:
    """Expects a warning with this class and `code` whose text contains all `mentions`."""
    with pytest.warns(kind) as caught:
        yield caught
    texts = [
        str(warning.message) for warning in caught if code in (None, getattr(warning.message, "code", None))
    ]
    assert texts, f"no {code} among {[str(warning.message) for warning in caught]}"
    facts = [str(fact) for fact in mentions]
    assert any(all(fact in text for fact in facts) for text in texts), f"{facts} not in one of {texts}"


def check_mentions(text: str, facts: Iterable[object]) -> None:
    """Asserts that a text contains each of these facts."""
    missing = [str(fact) for fact in facts if str(fact) not in text]
    assert not missing, f"{missing} not in {text}"


def notice_codes(notices: Iterable[Any]) -> list[str]:
    """The codes of notices, in order."""
    return [notice.code for notice in notices]


def has_notice(notices: Iterable[Any], code: str, *facts: object) -> bool:
    """True if a notice has this code and its text contains all `facts`.

    Facts are, for example, names and values.
    """
    return any(notice.code == code and all(str(fact) in str(notice) for fact in facts) for notice in notices)
