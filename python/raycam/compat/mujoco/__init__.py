"""Replacement for MuJoCo's renderer without OpenGL.

After `install()`, MuJoCo programs use this replacement: `mujoco.Renderer`, and the drawing functions `mjr_render` and
`mjr_readPixels`, which dm_control, Gymnasium and robosuite call. Depth and ids are exact for the ray through each
pixel's centre. Colours are computed with MuJoCo's own light model and resemble MuJoCo's images;
`MujocoScene.render` describes the differences.
"""

from .install import install, uninstall
from .renderer import Renderer

__all__ = ["Renderer", "install", "uninstall"]
