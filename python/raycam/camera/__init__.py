"""Cameras: `P = K R [I | -C]` with a lens, in the conventions of OpenCV and of Hartley and Zisserman."""

from ._background import Background
from .camera import Camera

__all__ = ["Background", "Camera"]
