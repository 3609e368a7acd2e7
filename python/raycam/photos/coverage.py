"""Coverage: the number of cameras to which each face is visible, as colours on the mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..camera import Camera
from ..render import render
from ..render.frame import Frame
from ..world import World
from ..world.face_geometry import face_normals
from .visibility import SurfaceVisibility

__all__ = ["coverage_colors", "coverage_picture", "coverage_world", "viridis"]

# Colours of the map viridis at even steps; Smith and van der Walt 2015.
VIRIDIS = (
    np.array(
        [
            (68, 1, 84),
            (71, 44, 122),
            (59, 81, 139),
            (44, 113, 142),
            (33, 144, 141),
            (39, 173, 129),
            (92, 200, 99),
            (170, 220, 50),
            (253, 231, 37),
        ]
    )
    / 255.0
)
SHADE = 0.55
"""Fraction by which the colour of edge-on faces is darkened."""
UNSEEN = np.array([0.85, 0.0, 0.55])


def coverage_colors(views: npt.NDArray[np.int32], most: int | None = None) -> npt.NDArray[np.uint8]:
    """Returns sRGB colours uint8 [n, 3] for the numbers of views [n].

    Faces with 0 views are magenta; other colours range from dark blue for 1 view to yellow for `most` or more.
    """
    top = max(int(views.max(initial=1)) if most is None else most, 2)
    colors = viridis(np.clip((views - 1) / (top - 1), 0, 1))
    colors[views == 0] = np.rint(UNSEEN * 255)
    return colors


def viridis(values: npt.NDArray[np.floating[Any]]) -> npt.NDArray[np.uint8]:
    """sRGB colours uint8 [..., 3] of values from 0 (dark blue) to 1 (yellow)."""
    place = values * (len(VIRIDIS) - 1)
    colors = [np.interp(place, np.arange(len(VIRIDIS)), VIRIDIS[:, i]) for i in range(3)]
    found: npt.NDArray[np.uint8] = np.rint(np.stack(colors, axis=-1) * 255).astype(np.uint8)
    return found


def coverage_world(
    world: World, seen: SurfaceVisibility, most: int | None = None, shaded_from: npt.ArrayLike | None = None
) -> World:
    """Returns a world whose faces have unlit colours that show each face's camera count.

    `seen` contains the faces, as returned by `surface_visibility`. With `shaded_from` [3], a point in the world,
    faces that are turned away from it are darker. `most` is as in `coverage_colors` (default: the largest count).
    """
    made = World(world.up)
    colors = coverage_colors(seen.views, most)
    for item in world.objects:
        own = seen.of(item.id)
        if own.any():
            corners = world.triangles(item.id)
            faces = np.arange(3 * len(corners)).reshape(-1, 3)
            own_colors = colors[own]
            if shaded_from is not None:
                towards = np.asarray(shaded_from, np.float64) - corners.mean(axis=1)
                towards /= np.maximum(np.sqrt((towards**2).sum(axis=1, keepdims=True)), 1e-300)
                cosine = np.abs((towards * face_normals(corners)).sum(axis=1, keepdims=True))
                own_colors = np.rint(own_colors * (1 - SHADE + SHADE * cosine)).astype(np.uint8)
            made.add_mesh(
                corners.reshape(-1, 3),
                faces,
                name=item.name,
                face_colors=own_colors,
                material={"type": "unlit"},
            )
    return made


def coverage_picture(
    world: World, seen: SurfaceVisibility, camera: Camera | None = None, most: int | None = None
) -> Frame:
    """Renders the coverage as seen from `camera` (default: a camera that shows the whole mesh).

    `world`, `seen` and `most` are as in `coverage_world`. Faces are darker the more they are turned away; the
    background is transparent.
    """
    if camera is None:
        camera = coverage_world(world, seen, most).view_from(size=(960, 640))
    colored = coverage_world(world, seen, most, shaded_from=camera.location)
    return render(colored, camera, samples=16, transparent_background=True)
