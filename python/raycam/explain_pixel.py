"""Former name of `raycam.explanation`, kept for one release."""

from __future__ import annotations

from .explanation import Candidate, Explanation, explain

__all__ = ["Candidate", "Explanation", "explain"]
