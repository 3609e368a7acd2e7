"""Notices about a stage, each with a code; equal notices about many prims are merged."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

__all__ = ["StageNotice", "group_notices"]

MAX_SINGLE = 3
"""Maximum number of equal notices that are listed prim by prim."""


@dataclass(frozen=True)
class StageNotice:
    """A notice about a stage."""

    code: str
    """The notice's code."""
    text: str
    """The notice's text."""
    subject: str = ""
    """The kind and path of the prim, written in front of the text; empty if the notice is about the whole stage."""

    def __str__(self) -> str:
        """The text with its subject."""
        return f"{self.subject}: {self.text}" if self.subject else self.text


def group_notices(notices: Iterable[StageNotice]) -> list[StageNotice]:
    """Merges notices about more than three prims, and removes repetitions.

    Notices are merged if they have the same code and text.
    """
    subjects: dict[tuple[str, str, str], dict[str, None]] = {}
    for notice in notices:
        kind, _, path = notice.subject.partition(" ")
        subjects.setdefault((notice.code, notice.text, kind), {})[path] = None
    grouped = []
    for (code, text, kind), paths in subjects.items():
        names = list(paths)
        if len(names) > MAX_SINGLE:
            shown = f"{', '.join(names[:MAX_SINGLE])} and {len(names) - MAX_SINGLE} more"
            grouped.append(StageNotice(code, text, f"{len(names)} x {kind} {shown}"))
        else:
            grouped.extend(StageNotice(code, text, f"{kind} {name}" if kind else "") for name in names)
    return grouped
