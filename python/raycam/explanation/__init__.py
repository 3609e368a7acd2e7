"""Explanations: every step by which a pixel gets its colour."""

from .explanation import SUBJECTS, Explanation, check_figure, explain
from .lidar_beam import BeamExplanation, explain_beam
from .steps import Candidate

__all__ = [
    "SUBJECTS",
    "BeamExplanation",
    "Candidate",
    "Explanation",
    "check_figure",
    "explain",
    "explain_beam",
]
