"""COCO: boxes, masks as run lengths or polygons, and keypoints.

Source: cocodataset.org, "Data format".
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from .. import _core
from ..annotations.labels import Label
from ..arguments import Bools
from ..errors import SettingsError, nearest
from .keypoint_labels import join_object_labels, keypoint_triples, owner_names
from .plan import Format, Index, Made, Plan, Record, Shot

__all__ = ["FORMAT"]

OPTIONS = {"segmentation": "rle", "min_pixels": 1, "keypoints": {}}


def check(plan: Plan) -> None:
    """Raises `SettingsError` for invalid options."""
    kind = plan.options["segmentation"]
    if kind not in ("rle", "polygon"):
        raise SettingsError(f'segmentation is {kind!r}, expected "rle" or "polygon"', code="invalid_value")
    for name, points in plan.options["keypoints"].items():
        if name not in plan.categories.values():
            raise SettingsError(
                f"keypoints: unknown category {name!r}, available: {list(plan.categories.values())}",
                code="unknown_name",
            )
        wanted = {"names", "points"}
        more = {"skeleton", "triangles", "objects"}
        if not (isinstance(points, dict) and wanted <= points.keys() <= wanted | more):
            raise SettingsError(
                f'keypoints of {name!r}: expected the keys "names", "points" and optionally "triangles", "objects", '
                '"skeleton"',
                code="wrong_shape",
            )
        if np.shape(points["points"]) != (len(points["names"]), 3):
            raise SettingsError(
                f"keypoints of {name!r}: expected one point [x, y, z] for each of {len(points['names'])} names, got "
                f"the shape {list(np.shape(points['points']))}",
                code="wrong_shape",
            )
        _check_owners(plan, name, points)
        triangles = points.get("triangles")
        if triangles is not None and len(triangles) != len(points["names"]):
            raise SettingsError(
                f"keypoints of {name!r}: expected one triangle for each of {len(points['names'])} names, got "
                f"{len(triangles)}",
                code="wrong_shape",
            )


def _check_owners(plan: Plan, category: str, points: dict[str, Any]) -> None:
    """Raises `SettingsError` for objects of points that do not exist or have another category."""
    owners = points.get("objects")
    if owners is None:
        return
    if not isinstance(owners, list | tuple) or len(owners) != len(points["names"]):
        raise SettingsError(
            f"keypoints of {category!r}: expected one object for each of {len(points['names'])} names, got {owners!r}",
            code="wrong_shape",
        )
    known = [item.name for item in plan.objects if (item.category or "object") == category]
    for name in (name for each in owners for name in owner_names(each)):
        if name not in known:
            raise SettingsError(
                nearest(f"object of the category {category!r}", name, known), code="unknown_name"
            )


def make(plan: Plan, number: int) -> Made:
    """Creates an image, and its annotations without ids."""
    shot = plan.shot(number)
    frame = shot.render(["color", "instance"])
    width, height = shot.camera.size
    name = f"images/{plan.picture_name(number)}.png"
    annotations = [
        annotation(shot, item)
        for item in join_object_labels(shot, shot.labels(frame["instance"]), plan.options["keypoints"])
        if item.visible_pixels >= max(int(plan.options["min_pixels"]), 1)
    ]
    image = {"id": number + 1, "width": width, "height": height, "file_name": name.removeprefix("images/")}
    image |= camera_of(shot)
    if shot.background_name is not None:
        image["background"] = shot.background_name
    return {name: frame.to_png()}, {"image": image, "annotations": annotations}


def camera_of(shot: Shot) -> Record:
    """Returns raycam's own keys of a row of `images`, which describe the camera.

    The keys are the camera's name, `pixel_center`, K in pixels, R and C (camera_from_world), lens model and
    coefficients, and time. K uses the camera's own `pixel_center`. A camera with parallel rays has its matrix P
    instead of K, R and C.
    """
    camera, view = shot.camera, shot.view
    found: Record = {"camera": view.label or view.name, "pixel_center": camera.pixel_center}
    if camera.is_parallel:
        found["P"] = camera.P.tolist()
    else:
        found |= {
            "K": camera.K.tolist(),
            "R": camera.R.tolist(),
            "C": camera.C.tolist(),
            "model": camera.model,
        }
    if camera.distortion is not None:
        found["distortion"] = camera.distortion.tolist()
    if shot.time is not None:
        found["time"] = shot.time
    return found


def annotation(shot: Shot, item: Label) -> Record:
    """Returns a COCO annotation, with two additional keys: `amodal_bbox` and `visible_fraction`."""
    plan = shot.plan
    found: Record = {
        "category_id": shot.category(item.object),
        "iscrowd": 0,
        "area": item.visible_pixels,
        "bbox": list(item.visible_box or (0, 0, 0, 0)),
        "segmentation": segmentation(item, plan.options["segmentation"]),
        "object": item.name,
        "amodal_bbox": list(item.amodal_box),
        "visible_fraction": item.visible_fraction,
    }
    points = plan.options["keypoints"].get(plan.categories[shot.category(item.object)])
    if points is not None:
        triples = keypoint_triples(shot, item, points)
        found["keypoints"] = [value for triple in triples for value in triple]
        found["num_keypoints"] = sum(triple[2] > 0 for triple in triples)
    return found


def segmentation(item: Label, kind: str) -> Any:
    """Returns the visible mask as compressed run lengths or as polygons.

    The run lengths cover the whole image; the polygons surround the mask's pixels.
    """
    if kind == "rle":
        mask = item.in_picture(item.visible_mask)
        return {"size": list(mask.shape), "counts": _core.mask_runs(mask)}
    x, y = item.region[:2]
    return [
        [value for u, v in corners for value in (u + x, v + y)] for corners in polygons(item.visible_mask)
    ]


def polygons(mask: Bools) -> list[list[list[int]]]:
    """Returns polygons along pixel edges that enclose a mask."""
    return _core.mask_polygons(np.ascontiguousarray(mask))


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Yields the annotation file's path and an iterator over the parts of its text.

    The text is never in memory as a whole, so memory does not grow with the number of images.
    """
    yield "annotations/instances.json", parts(plan, records)


def parts(plan: Plan, records: Callable[[], Iterator[Record]]) -> Iterator[bytes]:
    """Iterates over the text of the annotation file."""
    yield b'{"info": {"description": "made by raycam"}, "licenses": [],\n"categories": '
    yield json.dumps([category(plan, number) for number in sorted(plan.categories)]).encode()
    yield b',\n"images": ['
    for first, record in enumerate(records()):
        yield (b",\n" if first else b"\n") + json.dumps(record["image"]).encode()
    yield b'],\n"annotations": ['
    count = 0
    for record in records():
        for one in record["annotations"]:
            count += 1
            whole = {"id": count, "image_id": record["image"]["id"], **one}
            yield (b",\n" if count > 1 else b"\n") + json.dumps(whole).encode()
    yield b"]}\n"


def category(plan: Plan, number: int) -> Record:
    """Returns a category, with its keypoints, if any."""
    name = plan.categories[number]
    found: Record = {"id": number, "name": name, "supercategory": ""}
    points = plan.options["keypoints"].get(name)
    if points is not None:
        found |= {"keypoints": list(points["names"]), "skeleton": list(points.get("skeleton", []))}
    return found


FORMAT = Format(make, index, check, OPTIONS, many_worlds=True)
