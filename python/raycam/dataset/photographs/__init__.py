"""Ground truth for photographs: the data set format "photos" and its folder layouts."""

from .format import FORMAT, LAYOUTS

__all__ = ["FORMAT", "LAYOUTS"]
