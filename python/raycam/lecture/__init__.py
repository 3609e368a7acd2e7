"""The lecture on cameras and ray tracing.

This package contains the lecture's page, its notebooks, and the checks of their exercises.
"""
