"""Bundled data to try raycam with: it is part of the package and needs no download.

world = raycam.data.spot()
raycam.render(world).save("spot.png")
"""

from .files import NAMES, bundled, camera, fisheye, path, sky, spot

__all__ = ["NAMES", "bundled", "camera", "fisheye", "path", "sky", "spot"]
