"""The lecture on cameras and ray tracing: its page, its notebooks, and the checks of their exercises."""
