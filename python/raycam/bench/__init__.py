"""Speed of ray queries on this machine: `raycam bench`."""

from .measure import KINDS, BenchReport, BenchRow, bench, tile_order

__all__ = ["KINDS", "BenchReport", "BenchRow", "bench", "tile_order"]
