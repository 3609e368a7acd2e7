"""Cameras: `P = K R [I | -C]` with a lens.

The conventions are those of OpenCV and of Hartley and Zisserman.
"""

from ._background import Background
from .camera import Camera, check_camera

__all__ = ["Background", "Camera", "check_camera"]
