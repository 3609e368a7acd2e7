"""A contact sheet of a data set: one HTML page with labels drawn over the pictures, and the cameras from above."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...calibration import load_cameras
from ...camera import Camera
from ...errors import FormatError, SettingsError
from ...io.atomic_files import write

__all__ = ["contact_sheet"]

COLORS = (
    "#e6194b",
    "#3cb44b",
    "#4363d8",
    "#f58231",
    "#911eb4",
    "#008080",
    "#9a6324",
    "#808000",
    "#e6beff",
    "#000075",
)
MAX_PICTURES = 200

Pair = tuple[float, float]


class Mark(NamedTuple):
    """A label of a picture, in pixels from its top left corner."""

    name: str
    color: str
    box: tuple[float, float, float, float] | None
    polygons: list[list[Pair]]
    strips: list[tuple[int, int, int]]
    """Columns of a mask: x, first y, number of pixels."""
    points: list[tuple[float, float, int]]
    """Keypoints with their visibility, 1 or 2."""


def contact_sheet(folder: str | os.PathLike[str]) -> Path:
    """Writes `contact_sheet.html` into the folder of a data set ("coco" or "yolo") and returns its path.

    The page shows the first 200 pictures with boxes, masks and keypoints, and from above where the cameras look.
    Raises `SettingsError` for a folder that is no such data set; `FormatError` for broken labels.
    """
    place = Path(folder)
    if (place / "annotations/instances.json").is_file():
        pictures = list(_coco(place))
    elif (place / "data.yaml").is_file():
        pictures = list(_yolo(place))
    else:
        raise SettingsError(
            f"{place}: expected a data set with annotations/instances.json (coco) or data.yaml (yolo)"
        )
    figures = [_figure(*picture) for picture in pictures[:MAX_PICTURES]]
    more = f"<p>and {len(pictures) - MAX_PICTURES} more</p>" if len(pictures) > MAX_PICTURES else ""
    page = (
        "<!doctype html><meta charset=utf-8><title>contact sheet</title><style>body{font:14px sans-serif;margin:1em}"
        "figure{display:inline-block;margin:4px;position:relative}svg.labels{position:absolute;left:0;top:0}"
        f"</style>\n<h1>{html.escape(place.resolve().name)}</h1>\n{_top_view(place)}\n{''.join(figures)}{more}\n"
    )
    target = place / "contact_sheet.html"
    write(target, page.encode())
    return target


def _coco(place: Path) -> Iterator[tuple[str, tuple[int, int], list[Mark]]]:
    data = json.loads((place / "annotations/instances.json").read_bytes())
    names = {one["id"]: one["name"] for one in data["categories"]}
    marks: dict[int, list[Mark]] = {}
    for one in data["annotations"]:
        shape, strips, polygons = one["segmentation"], [], []
        if isinstance(shape, dict):
            strips = list(_strips(shape["counts"], shape["size"][0]))
        else:
            polygons = [list(zip(corners[::2], corners[1::2], strict=True)) for corners in shape]
        triples = np.reshape(one.get("keypoints", []), (-1, 3)).tolist()
        points = [(x, y, int(v)) for x, y, v in triples if v > 0]
        number = one["category_id"]
        own = Mark(names[number], COLORS[number % len(COLORS)], tuple(one["bbox"]), polygons, strips, points)
        marks.setdefault(one["image_id"], []).append(own)
    for image in data["images"]:
        size = (image["width"], image["height"])
        yield f"images/{image['file_name']}", size, marks.get(image["id"], [])


def _strips(counts: str, height: int) -> Iterator[tuple[int, int, int]]:
    """The columns of a mask in COCO's compressed run lengths. Source: pycocotools, maskApi.c, rleFrString."""
    runs: list[int] = []
    value = shift = 0
    for letter in counts.encode():
        bits = letter - 48
        value |= (bits & 31) << shift
        shift += 5
        if not bits & 32:
            value -= (bits & 16) and 1 << shift
            runs.append(value + (runs[-2] if len(runs) > 2 else 0))
            value = shift = 0
    at = 0
    for number, run in enumerate(runs):
        end = at + run
        while number % 2 and at < end:
            length = min(end - at, height - at % height)
            yield at // height, at % height, length
            at += length
        at = end


def _yolo(place: Path) -> Iterator[tuple[str, tuple[int, int], list[Mark]]]:
    names = dict(_names(place / "data.yaml"))
    for picture in sorted(place.glob("images/**/*.png")):
        name = picture.relative_to(place / "images").with_suffix(".txt")
        head = picture.read_bytes()[16:24]
        size = (int.from_bytes(head[:4], "big"), int.from_bytes(head[4:], "big"))
        labels = place / "labels" / name
        lines = labels.read_text().splitlines() if labels.is_file() else []
        yield (
            picture.relative_to(place).as_posix(),
            size,
            [_yolo_mark(line, names, size, labels) for line in lines],
        )


def _names(path: Path) -> Iterator[tuple[int, str]]:
    """The names of the classes in `data.yaml`, as raycam writes it."""
    inside = False
    for line in path.read_text(encoding="utf-8").splitlines():
        if inside and line.startswith("  "):
            number, _, name = line.strip().partition(": ")
            yield int(number), name.strip("'\"")
        else:
            inside = line == "names:"


def _yolo_mark(line: str, names: dict[int, str], size: tuple[int, int], path: Path) -> Mark:
    try:
        kind, *values = [float(word) for word in line.split()]
    except ValueError:
        raise FormatError(f"{path}: {line!r}: expected numbers") from None
    (w, h), number = size, int(kind)
    name, color = names.get(number, str(number)), COLORS[(number + 1) % len(COLORS)]
    if len(values) == 4 or (len(values) > 4 and (len(values) - 4) % 3 == 0 and len(values) % 2):
        x, y, width, height = values[:4]
        triples = np.reshape(values[4:], (-1, 3)).tolist()
        points = [(u * w, v * h, int(seen)) for u, v, seen in triples if seen > 0]
        return Mark(
            name, color, ((x - width / 2) * w, (y - height / 2) * h, width * w, height * h), [], [], points
        )
    corners = np.reshape(values, (-1, 2)) * size
    return Mark(name, color, None, [[(float(x), float(y)) for x, y in corners]], [], [])


def _figure(name: str, size: tuple[int, int], marks: list[Mark]) -> str:
    width, height = size
    shown = f'width="{max(width, 240)}"'
    drawn = "".join(map(_mark, marks))
    return (
        f'<figure><img {shown} src="{html.escape(name)}"><svg class=labels {shown} viewBox="0 0 {width} {height}">'
        f"{drawn}</svg><figcaption>{html.escape(name)}: {len(marks)}</figcaption></figure>\n"
    )


def _mark(mark: Mark) -> str:
    stroke = f'stroke="{mark.color}" vector-effect="non-scaling-stroke"'
    paths = [f"M{x} {y}h1v{n}h-1z" for x, y, n in mark.strips]
    paths += ["M" + "L".join(f"{x:g} {y:g}" for x, y in corners) + "z" for corners in mark.polygons]
    inside = (
        f'<path d="{"".join(paths)}" fill="{mark.color}" fill-opacity="0.4" fill-rule="evenodd"/>'
        if paths
        else ""
    )
    if mark.box is not None:
        x, y, w, h = mark.box
        inside += f'<rect x="{x:g}" y="{y:g}" width="{w:g}" height="{h:g}" fill="none" {stroke}/>'
    for x, y, seen in mark.points:
        fill = mark.color if seen == 2 else "none"
        inside += f'<circle cx="{x:g}" cy="{y:g}" r="1.5" fill="{fill}" {stroke}/>'
    return f"<g><title>{html.escape(mark.name)}</title>{inside}</g>"


def _top_view(place: Path) -> str:
    """The places of the cameras and where they look, on the plane of x and y; nothing where the set has no poses."""
    try:
        cameras = [camera for camera in load_cameras(place).values() if not camera.is_parallel]
    except (FormatError, SettingsError, ValueError):
        return "<p>the data set has no poses of its cameras</p>"
    return _plan_of(cameras) if cameras else ""


def _plan_of(cameras: list[Camera]) -> str:
    places = np.array([camera.C[:2] for camera in cameras])
    ahead = np.array([camera.R[2, :2] for camera in cameras])
    low, high = places.min(axis=0), places.max(axis=0)
    reach = max(float((high - low).max()), 1e-9)
    lines = ""
    for (x, y), (u, v) in zip((places - low) / reach * 200 + 30, ahead * 25, strict=True):
        lines += f'<circle cx="{x:.2f}" cy="{260 - y:.2f}" r="2"/><path d="M{x:.2f} {260 - y:.2f}l{u:.2f} {-v:.2f}"/>'
    caption = f"{len(cameras)} cameras from above: x to the right, y up, {reach:.3g} m across"
    drawn = f'<svg width="260" height="290" stroke="#333">{lines}</svg>'
    return f"<figure>{drawn}<figcaption>{caption}</figcaption></figure>"
