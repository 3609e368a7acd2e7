"""A small sensor for tests: a grid of distances, measured by rays, with noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt
import raycam


@dataclass(frozen=True)
class DepthSensor:
    """Distances along a grid of `columns` x `rows` rays.

    The rays point along x forward, with y left and z up. The rays of a row are cast at the same time, rows
    one after another within `duration` seconds.
    """

    columns: int = 5
    rows: int = 3
    duration: float = 0.0
    noise: float = 0.0
    world_from_sensor: tuple[tuple[float, ...], ...] = tuple(map(tuple, np.eye(4).tolist()))

    @property
    def pose(self) -> npt.NDArray[np.float64]:
        return np.array(self.world_from_sensor)

    @property
    def times(self) -> npt.NDArray[np.float64]:
        if not self.duration:
            return np.zeros(1)
        return ((np.arange(self.rows) + 0.5) / self.rows - 0.5) * self.duration

    def at_pose(self, R: npt.ArrayLike, C: npt.ArrayLike) -> Self:
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = np.asarray(R).T, C
        rows = tuple(map(tuple, pose.tolist()))
        return type(self)(self.columns, self.rows, self.duration, self.noise, rows)

    def directions(self) -> npt.NDArray[np.float64]:
        """Directions [rows, columns, 3] of the rays in sensor axes, with x = 1."""
        left = np.linspace(0.5, -0.5, self.columns)
        up = np.linspace(0.3, -0.3, self.rows)
        grid = np.ones((self.rows, self.columns, 3))
        grid[..., 1], grid[..., 2] = left[None], up[:, None]
        return grid

    def sample(
        self, world: raycam.World, *, frame: int = 0, threads: int | None = None
    ) -> dict[str, npt.NDArray[Any]]:
        pose = self.pose
        depth = np.empty((self.rows, self.columns))
        instance = np.empty((self.rows, self.columns), np.int32)
        rays = self.directions() @ pose[:3, :3].T
        for row in range(self.rows):
            # all rows see the world at the same time, which suffices for static worlds
            hits = world.cast_rays(pose[:3, 3], rays[row], fields=["t", "instance"], threads=threads)
            depth[row], instance[row] = hits["t"], hits["instance"]
        random = np.random.default_rng(frame)
        return {"depth": depth + self.noise * random.standard_normal(depth.shape), "instance": instance}

    def to_dict(self) -> dict[str, Any]:
        return {
            "columns": self.columns,
            "rows": self.rows,
            "duration": self.duration,
            "noise": self.noise,
            "world_from_sensor": self.pose.tolist(),
        }

    @classmethod
    def from_dict(cls, table: dict[str, Any]) -> Self:
        pose = tuple(map(tuple, table["world_from_sensor"]))
        return cls(table["columns"], table["rows"], table["duration"], table["noise"], pose)
