"""Writes YOLO: a text file for each image, with labels normalised by the image's size.

Source: Ultralytics, "Datasets".
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from ...annotations.labels import Label
from ...errors import Notice, SettingsError
from ..coco import polygons
from ..keypoint_labels import join_object_labels, keypoint_triples
from ..plan import Format, Index, Made, Plan, Record, Shot
from .splits import SPLITS, check_splits, split_names

__all__ = ["FORMAT"]

TASKS = ("detect", "segment", "pose", "obb")
OPTIONS = {"task": "detect", "min_pixels": 1, "keypoints": {}, "flip_idx": None, **SPLITS}

Points = npt.NDArray[np.float64]


def check(plan: Plan) -> None:
    """Raises `SettingsError` for invalid options."""
    check_splits(plan)
    task, points = plan.options["task"], plan.options["keypoints"]
    if task not in TASKS:
        raise SettingsError(f"task is {task!r}, expected one of {', '.join(TASKS)}", code="invalid_value")
    if bool(points) != (task == "pose"):
        raise SettingsError(
            'task "pose" and the option keypoints require each other: keypoints={"points": [[x, y, z], ...]} or '
            'keypoints="joints"',
            code="missing_value",
        )
    if (
        points
        and "robots" not in points
        and (not isinstance(points, dict) or np.ndim(points.get("points", 0)) != 2)
    ):
        raise SettingsError(
            'keypoints: expected {"points": [[x, y, z], ...]} in the coordinates of the meshes',
            code="wrong_shape",
        )
    flip = plan.options["flip_idx"]
    if flip is not None and (not points or sorted(flip) != list(range(_point_count(points)))):
        raise SettingsError(
            f"flip_idx is {flip!r}, expected a permutation of the keypoints' numbers",
            code="invalid_value",
        )


def make(plan: Plan, number: int) -> Made:
    """Creates an image and its labels; the label file is empty if no object is visible."""
    shot = plan.shot(number)
    frame = shot.render(["color", "instance"])
    place = f"{split_names(plan)[number]}/{plan.picture_name(number)}"
    least = max(int(plan.options["min_pixels"]), 1)
    classes = {category: i for i, category in enumerate(_class_categories(plan))}
    robots = plan.options["keypoints"].get("robots", {})
    lines = []
    for item in join_object_labels(shot, shot.labels(frame["instance"]), robots):
        if item.visible_pixels >= least and shot.category(item.object) in classes:
            values = numbers(shot, item)
            text = " ".join(_short(value) for value in values)
            lines.append(f"{classes[shot.category(item.object)]} {text}\n")
    files = {f"images/{place}.png": frame.to_png(), f"labels/{place}.txt": "".join(lines).encode()}
    return files, {"objects": len(lines)}


def _class_categories(plan: Plan) -> list[int]:
    """Returns the ids of the categories that are classes.

    These are all categories, or only the robots' categories if the keypoints are robots' joints.
    """
    robots = plan.options["keypoints"].get("robots")
    return sorted(number for number, name in plan.categories.items() if robots is None or name in robots)


def _point_count(points: dict[str, Any]) -> int:
    """Returns the number of keypoints of each label.

    Robots with fewer joints have additional points that are not labelled.
    """
    if "robots" in points:
        return max(len(robot["points"]) for robot in points["robots"].values())
    return len(points["points"])


def notices(plan: Plan) -> list[Notice]:
    """Returns a notice about categories that have no keypoints and are therefore not labelled."""
    classes = _class_categories(plan)
    others = [name for number, name in plan.categories.items() if number not in classes]
    if not others:
        return []
    text = f'keypoints="joints": objects without joints are not labelled: {", ".join(others[:10])}'
    return [Notice(text, "ignored_element", others[:3], len(others))]


def _short(value: float) -> str:
    return f"{value:.9f}".rstrip("0").rstrip(".") or "0"


def numbers(shot: Shot, item: Label) -> list[float]:
    """Returns the numbers of a label after its class."""
    task = shot.plan.options["task"]
    size = np.array(shot.camera.size, dtype=float)
    if task == "segment":
        return list(map(float, (joined(outlines(item)) / size).ravel()))
    if task == "obb":
        return list(map(float, (rectangle(np.concatenate(outlines(item)), size) / size).ravel()))
    x, y, w, h = item.visible_box or (0, 0, 0, 0)
    width, height = shot.camera.size
    box = [(x + w / 2) / width, (y + h / 2) / height, w / width, h / height]
    if task == "detect":
        return box
    given = shot.plan.options["keypoints"]
    category = shot.plan.categories[shot.category(item.object)]
    triples = keypoint_triples(shot, item, given["robots"][category] if "robots" in given else given)
    for across, down, visibility in triples:
        box += [across / width, down / height, float(visibility)]
    return box + [0.0] * 3 * (_point_count(given) - len(triples))


def outlines(item: Label) -> list[Points]:
    """Returns polygons [n, 2] around the visible pixels.

    Corners are in pixels from the image's top left corner. The polygon with the most corners is first.
    """
    found = [np.array(corners, dtype=float) + item.region[:2] for corners in polygons(item.visible_mask)]
    return sorted(found, key=lambda corners: -len(corners))


def joined(pieces: list[Points]) -> Points:
    """Joins several polygons into one polygon.

    A double edge without width connects the nearest corners of two polygons.
    """
    whole = pieces[0]
    for piece in pieces[1:]:
        apart = ((whole[:, None] - piece[None]) ** 2).sum(axis=2)
        i, j = np.unravel_index(int(apart.argmin()), apart.shape)
        whole = np.concatenate([whole[: i + 1], piece[j:], piece[: j + 1], whole[i:]])
    return whole


def rectangle(points: Points, size: Points) -> Points:
    """Returns the corners [4, 2], in order, of the rectangle of minimum area around points.

    One of its sides is on the points' hull, or the rectangle is upright. Because loaders reject labels that extend
    beyond the image, the corners are clipped to the image. If a point is then more than one pixel outside the
    rectangle, another rectangle is used.
    """
    hull = _hull(points)
    edges = np.concatenate([np.roll(hull, -1, axis=0) - hull, [[1.0, 0.0]]])
    best, least = hull[:4], np.inf
    for edge in edges[np.any(edges != 0, axis=1)]:
        along = edge / np.hypot(*edge)
        axes = np.array([along, [-along[1], along[0]]])
        turned = hull @ axes.T
        low, high = turned.min(axis=0), turned.max(axis=0)
        area = float(np.prod(high - low))
        corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]]) @ axes
        clipped = np.clip(corners, 0.0, size)
        if area < least - 1e-9 and _outside(hull, clipped) <= 1.0:
            best, least = clipped, area
    return best


def _outside(points: Points, corners: Points) -> float:
    """Returns the largest distance by which points lie outside a convex polygon, at least 0.

    `corners` [n, 2] are in mathematical (counterclockwise) order.
    """
    sides = np.roll(corners, -1, axis=0) - corners
    sides, starts = sides[np.any(sides != 0, axis=1)], corners[np.any(sides != 0, axis=1)]
    apart = points[:, None] - starts
    inward = (sides[:, 0] * apart[..., 1] - sides[:, 1] * apart[..., 0]) / np.hypot(*sides.T)
    return max(0.0, -float(inward.min(initial=0.0)))


def _hull(points: Points) -> Points:
    """The convex hull, counter-clockwise. Source: Andrew, 1979, "monotone chain"."""
    ordered = np.unique(points, axis=0)

    def chain(rows: Points) -> list[Points]:
        found: list[Points] = []
        for row in rows:
            while len(found) > 1 and _turn(found[-2], found[-1], row) <= 0:
                found.pop()
            found.append(row)
        return found[:-1]

    return np.array(chain(ordered) + chain(ordered[::-1]))


def _turn(a: Points, b: Points, c: Points) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates `data.yaml`: the folders of the splits, the names of the classes."""
    names = [plan.categories[number] for number in _class_categories(plan)]
    used = dict.fromkeys(plan.options["splits"])
    # Without `path`, Ultralytics uses the file's folder; `path: .` would be the current folder.
    lines = [f"{split}: images/{split}" for split in used]
    lines += [f"{split}: images/train" for split in ("train", "val") if split not in used and "train" in used]
    points: Any = plan.options["keypoints"]
    if points:
        lines.append(f"kpt_shape: [{_point_count(points)}, 3]")
        if plan.options["flip_idx"] is not None:
            lines.append(f"flip_idx: {list(plan.options['flip_idx'])}")
    lines += ["names:", *(f"  {i}: {name!r}" for i, name in enumerate(names))]
    if "robots" in points:
        lines += ["kpt_names:", *(f"  {i}: {_point_names(points, name)}" for i, name in enumerate(names))]
    yield "data.yaml", ["".join(line + "\n" for line in lines).encode()]


def _point_names(points: dict[str, Any], category: str) -> str:
    """The names of a robot's joints as a list in YAML; additional points have no joint."""
    own = points["robots"][category]["names"]
    return json.dumps([*own, *(f"unused_{number}" for number in range(len(own), _point_count(points)))])


FORMAT = Format(make, index, check, OPTIONS, many_worlds=True, notices=notices)
