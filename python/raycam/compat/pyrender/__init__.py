"""pyrender's names over raycam: scenes, nodes, cameras, lights and `OffscreenRenderer`, on the CPU, without a display.

    from raycam.compat import pyrender

or, for code that one does not own, before it is imported:

    import raycam.compat.pyrender
    raycam.compat.pyrender.install()
    import pyrender

Pictures are shaded as pyrender's default program does (`shading = "raycam"`: path traced); depth is that of pixel
centres, exact. `Viewer` opens in the browser. Not here, with an error that says so: text, morph targets, joints.
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
"""The light of images: "pyrender", the formula of its default program, or "raycam", path traced by raycam itself."""

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
"""The modules by which people reach the names, by pyrender's names of them."""
sampler, utils, renderer = texture, colors, offscreen
__version__ = "0.1.45"
"""The version of pyrender whose names these are."""
_before: dict[str, object] = {}


def install() -> None:
    """Makes `import pyrender` mean this module, in this process, until `uninstall`."""
    submodules: dict[str, ModuleType] = SUBMODULES | ABSENT
    modules = {"pyrender": sys.modules[__name__]} | {
        f"pyrender.{name}": one for name, one in submodules.items()
    }
    for name, module in modules.items():
        if sys.modules.get(name) is not module:
            _before.setdefault(name, sys.modules.get(name))
            sys.modules[name] = module


def uninstall() -> None:
    """Takes `install` back."""
    for name, module in _before.items():
        if module is None:
            sys.modules.pop(name, None)
        else:
            sys.modules[name] = module  # type: ignore[assignment]
    _before.clear()
