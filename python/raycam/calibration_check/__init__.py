"""Checks of a camera against OpenCV's calibration: `raycam selfcheck`."""

from .check import Calibration, SelfCheck, selfcheck

__all__ = ["Calibration", "SelfCheck", "selfcheck"]
