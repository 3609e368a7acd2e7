"""A requested pixel: its values, the surface point that it shows, and its explanation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arguments import Floats
from ..camera import Camera
from ..explanation import Explanation, explain
from ..explanation.lens import world_at_line
from ..explanation.page_figure import lines_figure, page_figure
from ..explanation.scene_figure import Line, light_lines, path_marks, tree_lines
from ..render.frame import CHANNELS, Frame
from ..world import World
from .stills import shares, truth

__all__ = ["explained", "explanation_parts", "ground_below", "locate", "values_at"]


def values_at(
    world: World, camera: Camera, still: Frame | None, u: int, v: int, names: Sequence[str]
) -> dict[str, Any]:
    """Returns the values of all channels of a pixel, in the form of the message `values`.

    Ids also have names; `names` are the names of the world's objects.

    Ground truth is rendered for this pixel only, on a separate thread; its bytes equal those of the whole image.
    """
    seen = truth(world, camera, region=(u, v, 1, 1), threads=1)
    channels = {name: array[0, 0] for name, array in seen.items()}
    if still is not None:
        channels = {name: array[v, u] for name, array in still.items()} | channels
        if "alpha" not in channels:  # the still image has a floor that is not part of the ground truth
            region = {"region": (u, v, 1, 1), "threads": 1}
            channels |= {name: array[0, 0] for name, array in shares(world, camera, **region).items()}
    values: dict[str, Any] = {}
    for name in CHANNELS:
        if name in channels:
            array = np.atleast_1d(channels[name])
            values[name] = {
                "dtype": array.dtype.name,
                "numbers": [_json(number) for number in array.tolist()],
            }
    instance = int(channels["instance"])
    if instance >= 0:
        values["instance"]["name"] = names[instance]
        values["material"]["slot"] = world._core.slot(instance, int(channels["triangle"]))
    category = world.categories.get(int(channels["category"]))
    if category is not None:
        values["category"]["name"] = category
    return values


def _json(number: float) -> float | str:
    """A number for JSON; infinity and NaN become strings for JavaScript's `Number`."""
    if math.isfinite(number):
        return number
    return "NaN" if math.isnan(number) else "Infinity" if number > 0 else "-Infinity"


def locate(world: World, camera: Camera, u: float, v: float) -> dict[str, Any]:
    """Returns the ray at a position in the image, and its hit.

    The position is in pixels from the top left corner of the image. The dict contains `origin` and `direction` of the
    ray, the surface `point` and the `bounds` of its object. Values without a ray or a hit are None.
    """
    pixel = np.array([u, v]) + camera.corner
    origin, direction = camera.rays(pixel)
    found: dict[str, Any] = dict.fromkeys(("origin", "direction", "point", "bounds"))
    if not np.isfinite(direction).all():
        return found
    found |= {"origin": origin.tolist(), "direction": direction.tolist()}
    there = world_at_line(world, camera, pixel)
    hit = there.cast_rays(origin, direction, fields=("position", "instance"), threads=1)
    if int(hit["instance"]) >= 0:
        corners = there.triangles(int(hit["instance"])).reshape(-1, 3)
        found["point"] = hit["position"].tolist()
        found["bounds"] = [corners.min(axis=0).tolist(), corners.max(axis=0).tolist()]
    return found


def ground_below(world: World, camera: Camera, place: Floats, foot: float) -> float | None:
    """The height of `place` [3] above the highest ground within `foot` metres.

    None if there is no ground below. Several rays at distances of `foot` are used, so that narrower gaps in the ground
    do not count.
    """
    up = 2 if camera.up == "z" else 1
    across = np.delete(np.eye(3), up, axis=0)
    starts = place + foot * np.concatenate([np.zeros((1, 3)), across, -across])
    directions = np.broadcast_to(-np.eye(3)[up], starts.shape).copy()
    found = float(world.cast_rays(starts, directions, fields=("t",), threads=1)["t"].min())
    return found if math.isfinite(found) else None


def explained(world: World, camera: Camera, u: int, v: int) -> tuple[dict[str, Any], list[Line]]:
    """Returns the message `explained` of a pixel, and the explained rays.

    Raises `CameraError` for a pixel without a ray.
    """
    explanation = explain(world, camera, (u, v))
    parts, lines = explanation_parts(explanation)
    return {"column": u, "row": v, **parts}, lines


def explanation_parts(explanation: Explanation) -> tuple[dict[str, Any], list[Line]]:
    """Returns the text and figures of an explanation, and the rays of light.

    The dict contains the text and the figure of the ray, and the text and figure of the light and of the tree in
    `sections`.
    """
    light, path, tree = explanation.lighting(), explanation.light_path(), explanation.tree()
    lines = light_lines(explanation.world, light, path)
    parts = {
        "text": str(explanation),
        "figure": page_figure(explanation),
        "sections": [
            {
                "title": "The light",
                "text": f"{light}\n\n{path}",
                "figure": lines_figure(explanation, lines, path_marks(path)),
            },
            {
                "title": "The tree",
                "text": str(tree),
                "figure": lines_figure(explanation, tree_lines(explanation, tree), []),
            },
        ],
    }
    return parts, lines
