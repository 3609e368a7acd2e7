"""Modules of pyrender that are not supported, each with an alternative."""

from __future__ import annotations

from types import ModuleType
from typing import Any

__all__ = ["ABSENT", "AbsentModule"]


class AbsentModule(ModuleType):
    """A module that can be imported, but whose names raise `ImportError` with an alternative."""

    def __init__(self, name: str, way: str) -> None:
        super().__init__(f"pyrender.{name}", f"Not supported: {way}.")
        self._said = f"pyrender.{name} is not in raycam.compat.pyrender: {way}"

    def __getattr__(self, name: str) -> Any:
        """Raises `ImportError`, or `AttributeError` for Python's own names.

        Programs use Python's own names to inspect modules.
        """
        if name.startswith("__") or name == "_said":
            raise AttributeError(f"{self.__name__} has no attribute {name!r}")
        raise ImportError(f"{name}: {self._said}")


ABSENT = {
    name: AbsentModule(name, way)
    for name, way in (
        ("font", "draw text on the image, for example with PIL.ImageDraw"),
        ("platforms", "raycam does not use OpenGL or EGL; OffscreenRenderer renders on the CPU"),
        (
            "shader_program",
            "raycam has no shaders; to render normals, create the same scene with raycam.World and raycam.Camera, and "
            'use raycam.render(world, camera, channels="normal"); for path tracing, set '
            'raycam.compat.pyrender.shading = "raycam"',
        ),
        (
            "trackball",
            "Viewer has its own mouse navigation; place cameras with scene.set_pose or raycam.Camera.look_at",
        ),
    )
}
"""The modules by their names in pyrender."""
