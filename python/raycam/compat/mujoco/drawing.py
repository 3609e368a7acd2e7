"""Replacements for MuJoCo's drawing functions: `mjv_updateScene`, `MjrContext`, `mjr_render`, `mjr_readPixels`, ...

dm_control, Gymnasium and robosuite call these functions.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any
from weakref import WeakKeyDictionary, WeakValueDictionary

import numpy as np

from raycam import Notice, SettingsError, WorldError

from .drawn_image import DrawnImage
from .model_scene import ModelScene
from .originals import original

__all__ = ["REPLACEMENTS", "MjrContext"]

NOT_DRAWN = ("mjr_overlay", "mjr_text", "mjr_label", "mjr_figure", "mjr_rectangle", "mjr_changeFont")
"""Functions for texts, figures and rectangles; they have no effect, with a notice."""
UNSUPPORTED = ("mjr_addAux", "mjr_setAux", "mjr_blitAux", "mjr_blitBuffer", "mjr_drawPixels")
"""Functions that copy pixels; they raise `SettingsError`."""
SOURCES: WeakValueDictionary[int, ModelScene] = WeakValueDictionary()
"""The scenes of models by the model's `id`; contexts and scenes of programs keep them alive."""
VIEWS: WeakKeyDictionary[Any, tuple[ModelScene, Any]] = WeakKeyDictionary()
"""For each `mjvScene`, its model's scene, and that scene's state at the last `mjv_updateScene` (None: no poses)."""


def _source(model: Any) -> ModelScene:
    """The scene of a model, shared by all contexts and scenes of the model."""
    found = SOURCES.get(id(model))
    if found is None:
        found = SOURCES[id(model)] = ModelScene(model)
    return found


class MjrContext:
    """Replacement for `mujoco.MjrContext`: the images that `mjr_render` has drawn into its buffer."""

    def __init__(self, model: Any = None, fontscale: Any = None) -> None:
        self._source = None if model is None else _source(model)
        view = None if model is None else model.vis.global_
        self.offWidth, self.offHeight = (0, 0) if view is None else (int(view.offwidth), int(view.offheight))
        """The size of the buffer outside of windows."""
        self.offSamples = 0 if model is None else int(model.vis.quality.offsamples)
        self.windowAvailable = 0
        self.currentBuffer = 0
        self.readDepthMap = 0
        """The values of depth images: 0 for 0 at the near plane, 1 for 0 at the far plane (`mjtDepthMap`)."""
        self.images: list[DrawnImage] = []

    def free(self) -> None:
        """Releases the images."""
        self.images.clear()


def update_scene(m: Any, d: Any, opt: Any, pert: Any, cam: Any, catmask: Any, scn: Any) -> None:
    """Replacement for `mujoco.mjv_updateScene`, which also keeps the state for `mjr_render`."""
    original("mjv_updateScene")(m, d, opt, pert, cam, catmask, scn)
    source, state = _source(m), None
    try:
        state = source.update(d, opt).frozen()
        state.remember_visual(scn)
    except WorldError as error:
        if error.code != "no_poses":
            raise
        text = "mjv_updateScene: data has no poses, so images are empty; call mujoco.mj_forward(model, data) first"
        warnings.warn(Notice(text, "no_poses"), stacklevel=2)
    VIEWS[scn] = source, state


def draw(viewport: Any, scn: Any, con: MjrContext) -> None:
    """Replacement for `mujoco.mjr_render`: the image is computed when it is read."""
    if scn not in VIEWS:
        text = (
            "mjr_render: the scene is empty; call mujoco.mjv_updateScene after raycam.compat.mujoco.install()"
        )
        warnings.warn(Notice(text, "missing_value"), stacklevel=2)
        return
    state = VIEWS[scn][1]
    if state is None or viewport.width < 1 or viewport.height < 1:
        return
    image = DrawnImage(viewport, state, scn, samples=4 if con.offSamples > 1 else 1)
    con.images = [other for other in con.images if not image.covers(other)] + [image]


def read_pixels(rgb: Any, depth: Any, viewport: Any, con: MjrContext) -> None:
    """Replacement for `mujoco.mjr_readPixels`: rows begin at the bottom, as in OpenGL."""
    size = int(viewport.height), int(viewport.width)
    for name, given, shape in (("rgb", rgb, (*size, 3)), ("depth", depth, size)):
        if given is None:
            continue
        if given.size != np.prod(shape) or not given.flags.c_contiguous:
            raise SettingsError(
                f"{name} must be a contiguous array with {np.prod(shape)} values for {size[1]} x {size[0]} pixels, "
                f"got the shape {list(given.shape)}",
                code="wrong_shape",
            )
        pixels = given.reshape(shape)
        pixels[...] = 0 if name == "rgb" or con.readDepthMap else 1
        for image in con.images:
            target, source = image.overlap(viewport)
            pixels[target] = (image.colors() if name == "rgb" else image.depth(con.readDepthMap))[source]


def resize_offscreen(width: int, height: int, con: MjrContext) -> None:
    """Replacement for `mujoco.mjr_resizeOffscreen`."""
    con.offWidth, con.offHeight = int(width), int(height)


def max_viewport(con: MjrContext) -> Any:
    """Replacement for `mujoco.mjr_maxViewport`."""
    import mujoco

    return mujoco.MjrRect(0, 0, con.offWidth, con.offHeight)


def set_buffer(framebuffer: Any, con: MjrContext) -> None:
    """Replacement for `mujoco.mjr_setBuffer`; there is only one buffer."""
    con.currentBuffer = int(framebuffer)


def restore_buffer(con: MjrContext) -> None:
    """Replacement for `mujoco.mjr_restoreBuffer`."""


def upload(m: Any, con: MjrContext, number: int) -> None:
    """Replacement for `mujoco.mjr_uploadTexture` and the like: the next scene shows the model's new arrays."""
    _source(m).forget()


def _not_drawn(name: str) -> Callable[..., None]:
    def skip(*values: Any, **keys: Any) -> None:
        text = f"{name} has no effect: raycam draws no texts, figures and rectangles"
        warnings.warn(Notice(text, "ignored_element"), stacklevel=2)

    return skip


def _unsupported(name: str) -> Callable[..., None]:
    def refuse(*values: Any, **keys: Any) -> None:
        raise SettingsError(f"{name} is not supported by raycam.compat.mujoco", code="unsupported_feature")

    return refuse


REPLACEMENTS: dict[str, Any] = {
    "MjrContext": MjrContext,
    "mjv_updateScene": update_scene,
    "mjr_render": draw,
    "mjr_readPixels": read_pixels,
    "mjr_resizeOffscreen": resize_offscreen,
    "mjr_maxViewport": max_viewport,
    "mjr_setBuffer": set_buffer,
    "mjr_restoreBuffer": restore_buffer,
    "mjr_finish": lambda: None,
    "mjr_getError": lambda: 0,
    **dict.fromkeys(("mjr_uploadTexture", "mjr_uploadMesh", "mjr_uploadHField"), upload),
    **{name: _not_drawn(name) for name in NOT_DRAWN},
    **{name: _unsupported(name) for name in UNSUPPORTED},
}
"""The replacements by their names in `mujoco`."""
