"""Replaces the rendering contexts of dm_control, so that `physics.render` needs no OpenGL."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from .drawing import MjrContext
from .originals import replace_name

__all__ = ["replace_contexts"]


class _Calls:
    """Calls functions directly; dm_control calls them in the thread of an OpenGL context."""

    def call(self, function: Callable[..., Any], *values: Any, **keys: Any) -> Any:
        return function(*values, **keys)


class _WindowlessContext:
    """The methods of dm_control's OpenGL contexts."""

    @contextmanager
    def make_current(self) -> Iterator[_Calls]:
        yield _Calls()

    def to_pixels(self, buffer: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Returns an image whose first row is the top row."""
        return np.flipud(buffer)

    def free(self) -> None:
        """Has no effect, because there is no context."""


class _DrawingContext:
    """The methods of dm_control's wrapper of `MjrContext`."""

    def __init__(self, model: Any) -> None:
        self.model = model
        self.ptr = MjrContext(model)

    def free(self) -> None:
        """Releases the images."""
        self.ptr.free()


def replace_contexts() -> None:
    """Replaces `dm_control.mujoco.Physics.contexts` if dm_control is installed."""
    if find_spec("dm_control") is None:
        return
    engine: Any = import_module("dm_control.mujoco.engine")
    found: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()

    def contexts(physics: Any) -> Any:
        """The rendering contexts of a `Physics`, created again after its model was reloaded."""
        model = physics.model.ptr
        if physics not in found or found[physics].mujoco.model is not model:
            found[physics] = engine.Contexts(gl=_WindowlessContext(), mujoco=_DrawingContext(model))
        return found[physics]

    replace_name(engine.Physics, "contexts", property(contexts))
