"""Replacements for MuJoCo's OpenGL contexts, which create no context."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

from .originals import replace_name

__all__ = ["GLContext", "replace_context_modules", "restore_context_modules"]

CLASSES = {
    "mujoco.egl": "GLContext",
    "mujoco.glfw": "GLContext",
    "mujoco.osmesa": "GLContext",
    "robosuite.renderers.context.egl_context": "EGLGLContext",
    "robosuite.renderers.context.glfw_context": "GLFWGLContext",
    "robosuite.renderers.context.osmesa_context": "OSMesaGLContext",
}
"""The classes of OpenGL contexts by their modules, which Gymnasium and robosuite import."""
_LOADED: dict[str, ModuleType | None] = {}


class GLContext:
    """Replacement for `mujoco.GLContext` and the classes of OpenGL contexts of its modules and of robosuite."""

    def __init__(self, max_width: int, max_height: int, device_id: int = 0) -> None:
        """Accepts the arguments of an OpenGL context, which have no effect."""

    def make_current(self) -> None:
        """Has no effect, because images need no context."""

    @contextmanager
    def as_current(self) -> Iterator[None]:
        """Has no effect, because images need no context."""
        yield

    def free(self) -> None:
        """Has no effect, because there is no context."""


def replace_context_modules() -> None:
    """Replaces `mujoco.GLContext` and the modules in `CLASSES`, without importing them."""
    import mujoco

    replace_name(mujoco, "GLContext", GLContext)
    for path, name in CLASSES.items():
        module = ModuleType(path, GLContext.__doc__)
        setattr(module, name, GLContext)
        _LOADED[path] = sys.modules.get(path)
        sys.modules[path] = module
        package, _, attribute = path.rpartition(".")
        if package in sys.modules:
            replace_name(sys.modules[package], attribute, module)


def restore_context_modules() -> None:
    """Restores MuJoCo's own modules; `mujoco.GLContext` is restored by `restore_names`."""
    for name, module in _LOADED.items():
        if module is None:
            sys.modules.pop(name, None)
        else:
            sys.modules[name] = module
    _LOADED.clear()
