"""Writes semantic PNG: label ids, instance ids as in Cityscapes, and a palette's colours.

Source: cityscapesScripts.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from ...arguments import whole
from ...errors import SettingsError
from ..plan import Format, Index, Made, Plan, Record, png

__all__ = ["FORMAT"]

OPTIONS = {"labels": {}, "void": 0, "palette": {}}


def label_ids(plan: Plan) -> dict[int, int]:
    """Returns the label id of each category."""
    given = plan.options["labels"]
    return {
        number: given.get(name, plan.options["void"] if given else number)
        for number, name in plan.categories.items()
    }


def check(plan: Plan) -> None:
    """Raises `SettingsError` for unknown categories, and ids above 255."""
    for option in ("labels", "palette"):
        for name in plan.options[option]:
            if name not in plan.categories.values():
                raise SettingsError(
                    f"{option}: unknown category {name!r}, available: {list(plan.categories.values())}",
                    code="unknown_name",
                )
    whole("void", plan.options["void"], 0, 255)
    for name, number in label_ids(plan).items():
        whole(f"the label id of {name!r}", number, 0, 255)
    for name, color in plan.options["palette"].items():
        if np.shape(color) != (3,) or not all(0 <= value <= 255 for value in color):
            raise SettingsError(
                f"palette of {name!r} is {color!r}, expected three numbers from 0 to 255", code="wrong_shape"
            )


def pascal_palette() -> npt.NDArray[np.uint8]:
    """Returns the colours [256, 3] of PASCAL VOC.

    The bits of an id are distributed to the channels. Source: VOC devkit, VOClabelcolormap.
    """
    palette = np.zeros((256, 3), dtype=np.uint8)
    for number in range(256):
        for bit in range(8):
            for channel in range(3):
                palette[number, channel] |= (number >> (3 * bit + channel) & 1) << (7 - bit) if bit < 3 else 0
    return palette


def make(plan: Plan, number: int) -> Made:
    """Creates an image, and the images of its label ids, instance ids and colours.

    Label ids have 8 bits. Instance ids have 16 bits and are the label id * 1000 + a count.
    """
    shot = plan.shot(number)
    frame = shot.render(["color", "instance"])
    void = plan.options["void"]
    labels = np.full(frame["instance"].shape, void, dtype=np.uint8)
    instances = labels.astype(np.uint16)
    ids = label_ids(plan)
    counts: dict[int, int] = {}
    colors = np.zeros((*labels.shape, 3), dtype=np.uint8)
    colors[:] = pascal_palette()[void]
    for item in shot.labels(frame["instance"]):
        if not item.visible_pixels:
            continue
        category = shot.category(item.object)
        own, mask = ids[category], item.in_picture(item.visible_mask)
        count = counts[own] = counts.get(own, -1) + 1
        if own * 1000 + count > 65535:
            raise SettingsError(
                f"instance id {own * 1000 + count} (label id {own} * 1000 + instance {count}) does not fit into 16 "
                "bits; use label ids up to 64",
                code="out_of_range",
            )
        labels[mask], instances[mask] = own, own * 1000 + count
        colors[mask] = plan.options["palette"].get(plan.categories[category], pascal_palette()[own])
    name = plan.picture_name(number)
    files = {
        f"images/{name}.png": frame.to_png(),
        f"labelIds/{name}.png": png(labels),
        f"instanceIds/{name}.png": png(instances),
        f"color/{name}.png": png(colors),
    }
    return files, {}


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates `labels.json`: id and colour of each category, and of pixels without a category."""
    palette = pascal_palette()
    ids = label_ids(plan)
    rows = [
        {
            "name": name,
            "id": ids[number],
            "color": [int(v) for v in plan.options["palette"].get(name, palette[ids[number]])],
        }
        for number, name in sorted(plan.categories.items())
    ]
    void = plan.options["void"]
    table = {"void": {"id": void, "color": palette[void].tolist()}, "categories": rows}
    yield "labels.json", [json.dumps(table, indent=2).encode() + b"\n"]


FORMAT = Format(make, index, check, OPTIONS, many_worlds=True)
