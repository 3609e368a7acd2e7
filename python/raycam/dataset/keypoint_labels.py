"""Labels of objects with keypoints.

The keypoints of a category may also belong to several objects.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..annotations.keypoints import keypoints
from ..annotations.labels import Label, join_labels
from .plan import Shot

__all__ = ["join_object_labels", "keypoint_triples", "owner_names"]


def join_object_labels(
    shot: Shot, labels: list[Label], points: Mapping[str, Mapping[str, Any]]
) -> list[Label]:
    """Returns the labels, joined for each category whose keypoints belong to several objects.

    If the keypoints of a category have "objects", the category's labels are joined into one label. `points`
    are the keypoints by category.
    """
    found: list[Label] = []
    parts: dict[str, list[Label]] = {}
    for item in labels:
        category = shot.plan.categories[shot.category(item.object)]
        if "objects" in points.get(category, ()):
            parts.setdefault(category, []).append(item)
        else:
            found.append(item)
    return [*found, *(join_labels(items, category) for category, items in parts.items())]


def owner_names(owners: str | list[str]) -> list[str]:
    """Returns the objects of a keypoint.

    The keypoint moves with the first object; the other objects do not occlude the keypoint.
    """
    return [owners] if isinstance(owners, str) else list(owners)


def keypoint_triples(shot: Shot, item: Label, points: Mapping[str, Any]) -> list[tuple[float, float, int]]:
    """Returns x, y and the visibility of each keypoint of a labelled object.

    Positions are in pixels from the image's top left corner. The visibility is 2, or 1 if something occludes the
    point. A point outside the image has (0, 0, 0). `points` has the keys "points" [n, 3] and optionally
    "objects" and "triangles".
    """
    places = points["points"]
    ids = {each.name: each.id for each in shot.objects}
    given = points.get("objects", [item.name] * len(places))
    owners = [[ids[name] for name in owner_names(each)] for each in given]
    seen = keypoints(
        shot.world,
        shot.camera,
        places,
        [first for first, *_ in owners],
        triangles=points.get("triangles"),
        threads=shot.plan.threads,
    )
    own = [
        "objects" in points and int(occluder) in each
        for occluder, each in zip(seen.occluder, owners, strict=True)
    ]
    found = []
    for pixel, inside, visible in zip(seen.pixels, seen.in_picture, seen.visible | own, strict=True):
        x, y = pixel - shot.camera.corner
        found.append((float(x), float(y), 2 if visible else 1) if inside else (0, 0, 0))
    return found
