"""Explanations: every step by which a pixel gets its colour."""

from .explanation import SUBJECTS, Candidate, Explanation, check_figure, explain

__all__ = ["SUBJECTS", "Candidate", "Explanation", "check_figure", "explain"]
