"""Writes COCO's panoptic format: an image of segment ids and a table of segments.

Source: cocodataset.org, "Data format".
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator

import numpy as np

from ...errors import SettingsError
from ..plan import Format, Index, Made, Plan, Record, png
from .semantic import pascal_palette

__all__ = ["FORMAT"]


def check(plan: Plan) -> None:
    """Raises `SettingsError` for unknown categories in `stuff`."""
    for name in plan.options["stuff"]:
        if name not in plan.categories.values():
            raise SettingsError(
                f"stuff: unknown category {name!r}, available: {list(plan.categories.values())}",
                code="unknown_name",
            )


def make(plan: Plan, number: int) -> Made:
    """Creates an image, the image of its segments, and its annotation.

    A segment's id is R + 256 G + 65536 B; the id 0 is void. All objects of a category in `stuff` form one segment;
    every object of another category is one segment. Objects without a category are void.
    """
    shot = plan.shot(number)
    frame = shot.render(["color", "instance"])
    instance = frame["instance"]
    ids = np.zeros(instance.shape, dtype=np.uint32)
    stuff = set(plan.options["stuff"])
    segments: dict[int, Record] = {}
    for item in shot.labels(instance):
        if not item.visible_pixels:
            continue
        category = shot.category(item.object)
        first = item.object + 1
        if plan.categories[category] in stuff:
            same = [key for key, one in segments.items() if one["category_id"] == category]
            first = same[0] if same else first
        ids[item.in_picture(item.visible_mask)] = first
        segments.setdefault(first, {"id": first, "category_id": category, "iscrowd": 0})
    for key, segment in segments.items():
        rows, columns = np.nonzero(ids == key)
        left, top = int(columns.min()), int(rows.min())
        segment["area"] = len(rows)
        segment["bbox"] = [left, top, int(columns.max()) - left + 1, int(rows.max()) - top + 1]
    name = plan.picture_name(number)
    colors = np.stack([ids % 256, ids // 256 % 256, ids // 65536], axis=-1).astype(np.uint8)
    width, height = shot.camera.size
    image = {"id": number + 1, "width": width, "height": height, "file_name": f"{name}.png"}
    annotation = {
        "image_id": number + 1,
        "file_name": f"{name}.png",
        "segments_info": list(segments.values()),
    }
    files = {f"images/{name}.png": frame.to_png(), f"panoptic/{name}.png": png(colors)}
    return files, {"image": image, "annotation": annotation}


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates the file of annotations of all images, in pieces."""
    yield "annotations/panoptic.json", _parts(plan, records)


def _parts(plan: Plan, records: Callable[[], Iterator[Record]]) -> Iterator[bytes]:
    stuff, palette = set(plan.options["stuff"]), pascal_palette()
    kinds = [
        {
            "id": number,
            "name": name,
            "supercategory": "",
            "isthing": int(name not in stuff),
            "color": palette[(number - 1) % 255 + 1].tolist(),
        }
        for number, name in sorted(plan.categories.items())
    ]
    yield b'{"info": {"description": "made by raycam"}, "licenses": [],\n"categories": '
    yield json.dumps(kinds).encode()
    for key, of in (("images", "image"), ("annotations", "annotation")):
        yield f',\n"{key}": ['.encode()
        for first, record in enumerate(records()):
            yield (b",\n" if first else b"\n") + json.dumps(record[of]).encode()
        yield b"]"
    yield b"}\n"


FORMAT = Format(make, index, check, {"stuff": []}, many_worlds=True)
