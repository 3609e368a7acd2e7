"""One image that `mjr_render` has drawn: colours or segment numbers, and depth, computed when they are read."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from raycam import render

from .gl_camera import gl_camera
from .renderer import element_ids

__all__ = ["DrawnImage"]

SEGMENT, IDCOLOR = 8, 9
"""Values of `mjtRndFlag` for images of segments, and for segment numbers as colours."""
HALTON_BASES = (2, 3, 5)
"""Bases of the sequences from which MuJoCo takes the colours of segments."""
Part = tuple[slice, slice]


class DrawnImage:
    """The image of an `mjvScene` in a viewport (`MjrRect`); its arrays begin with the bottom row, as in OpenGL.

    `state` is the `MujocoScene` of the last `mjv_updateScene`.
    """

    def __init__(self, viewport: Any, state: Any, visual: Any, *, samples: int) -> None:
        self._corner = int(viewport.bottom), int(viewport.left)
        self._size = int(viewport.height), int(viewport.width)
        self._camera = gl_camera(visual, self._size[::-1])
        self._scene = state.with_changes(visual, self._camera)
        self._flags, self._samples = np.array(visual.flags), samples
        view = visual.camera[0]
        self._near, self._far = float(view.frustum_near), float(view.frustum_far)
        self._segments: dict[tuple[int, int], int] = {}
        if self._flags[SEGMENT]:
            geoms = visual.geoms[: visual.ngeom]
            self._segments = {(int(geom.objid), int(geom.objtype)): int(geom.segid) for geom in geoms}
        self._colors: npt.NDArray[np.uint8] | None = None
        self._depth: npt.NDArray[np.float64] | None = None

    def covers(self, other: DrawnImage) -> bool:
        """True if this image replaces every pixel of another image."""
        return all(
            start <= begin and begin + length <= start + extent
            for start, extent, begin, length in zip(
                self._corner, self._size, other._corner, other._size, strict=True
            )
        )

    def overlap(self, viewport: Any) -> tuple[Part, Part]:
        """The rows and columns that this image fills in another viewport, and the same pixels in this image."""
        target, source = [], []
        for start, extent, begin, length in zip(
            self._corner,
            self._size,
            (int(viewport.bottom), int(viewport.left)),
            (int(viewport.height), int(viewport.width)),
            strict=True,
        ):
            first, end = max(start, begin), max(min(start + extent, begin + length), start, begin)
            target.append(slice(first - begin, end - begin))
            source.append(slice(first - start, end - start))
        return (target[0], target[1]), (source[0], source[1])

    def colors(self) -> npt.NDArray[np.uint8]:
        """sRGB colours [h, w, 3], or the colours of segments if the scene's flag `mjRND_SEGMENT` is set."""
        if self._colors is None:
            if self._flags[SEGMENT]:
                self._colors = self._segment_colors()
            else:
                self._scene.flags[: len(self._flags)] = self._flags
                self._colors = self._scene.render(self._camera, samples=self._samples)[::-1]
        return self._colors

    def _segment_colors(self) -> npt.NDArray[np.uint8]:
        instance = render(self._scene.world, self._camera, channels=["instance"])["instance"]
        ids = element_ids(self._scene, instance)[::-1]
        found, places = np.unique(ids.reshape(-1, 2), axis=0, return_inverse=True)
        segments = [self._segments.get((int(number), int(kind)), -1) for number, kind in found]
        table = np.array(
            [_segment_color(segment, bool(self._flags[IDCOLOR])) for segment in segments], np.uint8
        )
        return table[places.ravel()].reshape(*ids.shape[:2], 3)

    def depth(self, depth_map: int) -> npt.NDArray[np.float32]:
        """Values of OpenGL's depth buffer [h, w]: 0 at the near plane and 1 at the far plane, or reversed.

        `depth_map` is a value of `mjtDepthMap`. Surfaces in front of the near plane have its value.
        """
        if self._depth is None:
            depth = render(self._scene.world, self._camera, channels=["depth"])["depth"][::-1]
            self._depth = np.clip(np.fmin(depth, self._far).astype(np.float64), self._near, self._far)
        share = (1 / self._depth - 1 / self._far) / (1 / self._near - 1 / self._far)
        return (share if depth_map else 1 - share).astype(np.float32)


def _segment_color(segment: int, is_number: bool) -> tuple[int, ...]:
    """The colour of a segment: its number plus 1 as three bytes, or MuJoCo's pseudorandom colour."""
    if segment < 0:
        return 0, 0, 0
    if is_number:
        number = segment + 1
        return number & 255, number >> 8 & 255, number >> 16 & 255
    return tuple(round(255 * (0.1 + 0.8 * _halton(segment + 10, base))) for base in HALTON_BASES)


def _halton(index: int, base: int) -> float:
    """A value of the Halton sequence in [0, 1)."""
    found, share = 0.0, 1.0
    while index > 0:
        share /= base
        index, digit = divmod(index, base)
        found += share * digit
    return found
