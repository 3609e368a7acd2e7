"""Replaces MuJoCo's renderer in a program, and restores it."""

from __future__ import annotations

from .dm_control import replace_contexts
from .drawing import REPLACEMENTS
from .gl_context import replace_context_modules, restore_context_modules
from .originals import replace_name, restore_names
from .renderer import Renderer

__all__ = ["install", "uninstall"]


def install() -> None:
    """Replaces `mujoco.Renderer`, MuJoCo's drawing functions and OpenGL contexts.

    Gymnasium (`render_mode="rgb_array"`), dm_control (`physics.render`) and robosuite then need no OpenGL. Call it
    before these packages are imported, and leave the environment variable `MUJOCO_GL` unset.
    """
    import mujoco

    if mujoco.Renderer is Renderer:
        return
    replace_name(mujoco, "Renderer", Renderer)
    for name, replacement in REPLACEMENTS.items():
        if hasattr(mujoco, name):
            replace_name(mujoco, name, replacement)
    replace_context_modules()
    replace_contexts()


def uninstall() -> None:
    """Restores MuJoCo's own renderer, drawing functions and OpenGL contexts."""
    restore_names()
    restore_context_modules()
