"""Explanations: every step by which a pixel gets its colour."""

from .explanation import SUBJECTS, Explanation, check_figure, explain
from .steps import Candidate

__all__ = ["SUBJECTS", "Candidate", "Explanation", "check_figure", "explain"]
