"""Writes a contact sheet of a data set as one HTML page.

The page shows the images with labels drawn over them, and a top view of the cameras.
"""

from __future__ import annotations

import html
import os
from pathlib import Path

import numpy as np

from ...calibration import load_cameras
from ...camera import Camera
from ...errors import FormatError, SettingsError
from ...io.atomic_files import write
from ...one_line import counted
from .marks import LabelledPicture, Mark, pictures_of

__all__ = ["contact_sheet"]

MAX_PICTURES = 200


def contact_sheet(folder: str | os.PathLike[str]) -> Path:
    """Writes `contact_sheet.html` into the folder of a data set and returns its path.

    The page shows the first 200 images with the labels of the data set's own files: boxes, masks, keypoints, and the
    axes of objects with poses. It also contains a top view of the cameras' fields of view. Supported formats are
    "coco", "yolo", "bop", "mot", "kitti", "panoptic", "semantic" and "replicator". Raises `SettingsError` for a folder
    without such a data set, and `FormatError` for malformed labels.
    """
    place = Path(folder)
    pictures = pictures_of(place)
    figures = [_figure(picture) for picture in pictures[:MAX_PICTURES]]
    more = f"<p>and {len(pictures) - MAX_PICTURES} more</p>" if len(pictures) > MAX_PICTURES else ""
    page = (
        "<!doctype html><meta charset=utf-8><title>contact sheet</title><style>body{font:14px sans-serif;margin:1em}"
        "figure{display:inline-block;margin:4px;position:relative}.labels{position:absolute;left:0;top:0}"
        "img.labels{opacity:.5;image-rendering:pixelated}img.ids{filter:brightness(30)}"
        f"</style>\n<h1>{html.escape(place.resolve().name)}</h1>\n{_top_view(place)}\n{''.join(figures)}{more}\n"
    )
    target = place / "contact_sheet.html"
    write(target, page.encode())
    return target


def _figure(picture: LabelledPicture) -> str:
    width, height = picture.size
    shown = f'width="{max(width, 240)}"'
    drawn = "".join(map(_mark, picture.marks))
    kind = "labels ids" if picture.has_ids else "labels"
    over = f'<img class="{kind}" {shown} src="{html.escape(picture.mask)}">' if picture.mask else ""
    name = html.escape(picture.file)
    return (
        f'<figure><img {shown} src="{name}">{over}<svg class=labels {shown} viewBox="0 0 {width} {height}">'
        f"{drawn}</svg><figcaption>{name}: {len(picture.marks)}</figcaption></figure>\n"
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
    for color, (x, y), (u, v) in mark.axes:
        inside += f'<path d="M{x:.2f} {y:.2f}L{u:.2f} {v:.2f}" stroke="{color}" vector-effect="non-scaling-stroke"/>'
    return f"<g><title>{html.escape(mark.name)}</title>{inside}</g>"


def _top_view(place: Path) -> str:
    """Returns HTML with the positions and directions of the cameras in the x-y plane.

    For a data set without poses, the HTML is a sentence. The HTML is empty if all cameras have parallel rays.
    """
    try:
        cameras = [camera for camera in load_cameras(place).values() if not camera.is_parallel]
    except (FormatError, SettingsError, ValueError):
        return "<p>the data set contains no camera poses</p>"
    return _plan_of(cameras) if cameras else ""


def _plan_of(cameras: list[Camera]) -> str:
    """Returns HTML with the cameras from above, each with its field of view.

    Overlapping fields of view show the areas that are visible to several cameras.
    """
    places = np.array([camera.C[:2] for camera in cameras])
    low, high = places.min(axis=0), places.max(axis=0)
    reach = max(float((high - low).max()), 1e-9)
    lines = fans = ""
    for camera, (x, y) in zip(cameras, (places - low) / reach * 200 + 60, strict=True):
        width, height = camera.size
        seen = camera.rays([[u, (height - 1) / 2] for u in np.linspace(0, width - 1, 9)])[1][:, :2]
        u, v = camera.R[2, :2] * 25
        corners = "".join(
            f"L{x + 160 * a:.1f} {320 - y - 160 * b:.1f}" for a, b in seen if np.isfinite(a + b)
        )
        fans += f'<path d="M{x:.1f} {320 - y:.1f}{corners}z"/>'
        lines += f'<circle cx="{x:.2f}" cy="{320 - y:.2f}" r="2"/><path d="M{x:.2f} {320 - y:.2f}l{u:.2f} {-v:.2f}"/>'
    whose = counted(len(cameras), "camera")
    caption = f"fields of view of {whose} from above: x to the right, y up, {reach:.3g} m across"
    fill = f'<g fill="#4363d8" fill-opacity="{max(0.3 / len(cameras) ** 0.5, 0.02):.3f}" stroke="none">{fans}</g>'
    drawn = f'<svg width="320" height="320">{fill}<g stroke="#333">{lines}</g></svg>'
    return f"<figure>{drawn}<figcaption>{caption}</figcaption></figure>"
