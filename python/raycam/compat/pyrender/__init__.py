"""Replacement for pyrender on the CPU, without a display.

The package contains scenes, nodes, cameras, lights and `OffscreenRenderer`. Programs import this package:

    from raycam.compat import pyrender

If the code that imports pyrender cannot be edited, call `install()` before that code is imported:

    import raycam.compat.pyrender
    raycam.compat.pyrender.install()
    import pyrender

Images are shaded with the formulas of pyrender's default shader, or path traced with `shading = "raycam"`. Depth is
exact at pixel centres. `Viewer` opens in the browser. Text, morph targets and joints are not supported and raise
errors.
"""

from __future__ import annotations

import sys
from types import ModuleType

from . import (
    camera,
    colors,
    constants,
    light,
    material,
    mesh,
    node,
    primitive,
    scene,
    texture,
    viewer,
)
from .absent import ABSENT
from .camera import Camera, IntrinsicsCamera, OrthographicCamera, PerspectiveCamera
from .constants import GLTF, RenderFlags, TextAlign
from .light import DirectionalLight, Light, PointLight, SpotLight
from .material import Material, MetallicRoughnessMaterial
from .mesh import Mesh
from .node import Node
from .picture import offscreen
from .picture.offscreen import OffscreenRenderer, Renderer
from .primitive import Primitive
from .scene import Scene
from .texture import Sampler, Texture
from .viewer import Viewer

__all__ = [
    "GLTF",
    "Camera",
    "DirectionalLight",
    "IntrinsicsCamera",
    "Light",
    "Material",
    "Mesh",
    "MetallicRoughnessMaterial",
    "Node",
    "OffscreenRenderer",
    "OrthographicCamera",
    "PerspectiveCamera",
    "PointLight",
    "Primitive",
    "RenderFlags",
    "Renderer",
    "Sampler",
    "Scene",
    "SpotLight",
    "TextAlign",
    "Texture",
    "Viewer",
    "install",
    "shading",
    "uninstall",
]

shading = "pyrender"
"""The shading of images: "pyrender" for the formulas of its default shader, "raycam" for path tracing."""

SUBMODULES = {
    "camera": camera,
    "constants": constants,
    "light": light,
    "material": material,
    "mesh": mesh,
    "node": node,
    "offscreen": offscreen,
    "primitive": primitive,
    "renderer": offscreen,
    "sampler": texture,
    "scene": scene,
    "texture": texture,
    "utils": colors,
    "viewer": viewer,
}
"""Submodules by their names in pyrender."""
sampler, utils, renderer = texture, colors, offscreen
__version__ = "0.1.45"
"""The pyrender version whose interface this module implements."""
_before: dict[str, object] = {}


def install() -> None:
    """Makes `import pyrender` import this module, in this process, until `uninstall`."""
    submodules: dict[str, ModuleType] = SUBMODULES | ABSENT
    modules = {"pyrender": sys.modules[__name__]} | {
        f"pyrender.{name}": one for name, one in submodules.items()
    }
    for name, module in modules.items():
        if sys.modules.get(name) is not module:
            _before.setdefault(name, sys.modules.get(name))
            sys.modules[name] = module


def uninstall() -> None:
    """Undoes `install`."""
    for name, module in _before.items():
        if module is None:
            sys.modules.pop(name, None)
        else:
            sys.modules[name] = module  # type: ignore[assignment]
    _before.clear()
