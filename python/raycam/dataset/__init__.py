"""Data sets: images of a world with their ground truth.

The files have the formats that training and evaluation tools read.

raycam.dataset.write(world, "apples", "coco", cameras=cameras)
"""

from .formats import FORMATS
from .write import DatasetResult, views, write

__all__ = ["FORMATS", "DatasetResult", "views", "write"]
