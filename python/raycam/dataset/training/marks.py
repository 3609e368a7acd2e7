"""Labels read from the files of data sets, in pixels, for contact sheets."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...errors import FormatError, SettingsError

__all__ = ["LabelledPicture", "Mark", "pictures_of"]

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
Pair = tuple[float, float]


class Mark(NamedTuple):
    """A label of an image, in pixels from the image's top left corner."""

    name: str
    color: str
    box: tuple[float, float, float, float] | None
    polygons: list[list[Pair]]
    strips: list[tuple[int, int, int]]
    """Columns of a mask: x, first y, number of pixels."""
    points: list[tuple[float, float, int]]
    """Keypoints with their visibility, 1 or 2."""
    axes: tuple[tuple[str, Pair, Pair], ...] = ()
    """Axes of an object: colour, start, end."""


class LabelledPicture(NamedTuple):
    """An image of a data set with its labels."""

    file: str
    """The image's path in the data set's folder."""
    size: tuple[int, int]
    marks: list[Mark]
    mask: str | None = None
    """The path of an image of masks, which is drawn over the image."""
    has_ids: bool = False
    """True if the mask image contains ids instead of colours."""


def pictures_of(place: Path) -> list[LabelledPicture]:
    """Returns the images of a data set with their labels.

    Raises `SettingsError` for a folder without any of the `MARKERS`.
    """
    for pattern, read in MARKERS.items():
        if next(place.glob(pattern), None) is not None:
            return list(read(place))
    known = ", ".join(MARKERS)
    raise SettingsError(
        f"{place}: not a data set; expected a folder that contains one of {known}", code="unknown_format"
    )


def _size(picture: Path) -> tuple[int, int]:
    """Columns and rows of a PNG."""
    head = picture.read_bytes()[16:24]
    return int.from_bytes(head[:4], "big"), int.from_bytes(head[4:], "big")


def _box(name: str, number: int, corners: Any) -> Mark:
    """Returns the mark of a box whose `corners` are its left, top, right and bottom edges."""
    left, top, right, bottom = (float(value) for value in corners)
    return Mark(name, COLORS[number % len(COLORS)], (left, top, right - left, bottom - top), [], [], [])


def _numbers(line: str, path: Path, between: str | None = None) -> list[float]:
    try:
        return [float(word) for word in line.split(between)]
    except ValueError:
        raise FormatError(f"{path}: expected numbers, got the line {line!r}", code="wrong_type") from None


def _coco(place: Path) -> Iterator[LabelledPicture]:
    return _coco_pictures(place / "annotations/instances.json", "images/")


def _coco_pictures(path: Path, folder: str) -> Iterator[LabelledPicture]:
    data = json.loads(path.read_bytes())
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
        color = COLORS[number % len(COLORS)]
        own = Mark(names[number], color, tuple(one["bbox"]), polygons, strips, points)
        marks.setdefault(one["image_id"], []).append(own)
    for image in data["images"]:
        size = (image["width"], image["height"])
        yield LabelledPicture(f"{folder}{image['file_name']}", size, marks.get(image["id"], []))


def _strips(counts: str, height: int) -> Iterator[tuple[int, int, int]]:
    """Yields the vertical runs of a mask in COCO's compressed run lengths: column, row, length.

    Source: pycocotools, maskApi.c, rleFrString.
    """
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


def _yolo(place: Path) -> Iterator[LabelledPicture]:
    names = dict(_names(place / "data.yaml"))
    for picture in sorted(place.glob("images/**/*.png")):
        name = picture.relative_to(place / "images").with_suffix(".txt")
        size = _size(picture)
        labels = place / "labels" / name
        lines = labels.read_text().splitlines() if labels.is_file() else []
        yield LabelledPicture(
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
        raise FormatError(f"{path}: expected numbers, got the line {line!r}", code="wrong_type") from None
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


def _bop(place: Path) -> Iterator[LabelledPicture]:
    for scene in sorted(path.parent for path in place.glob("*/*/scene_gt.json")):
        truth, cameras = (
            json.loads((scene / f"scene_{name}.json").read_bytes()) for name in ("gt", "camera")
        )
        models = json.loads((place / "models/models_info.json").read_bytes())
        folder = scene.relative_to(place).as_posix() + "/"
        for picture in _coco_pictures(scene / "scene_gt_coco_modal.json", folder):
            number = str(int(Path(picture.file).stem))
            K = np.reshape(cameras[number]["cam_K"], (3, 3)).astype(float)
            axes = [_axes(K, one, models[str(one["obj_id"])]["diameter"]) for one in truth[number]]
            posed = [Mark("axes", "none", None, [], [], [], axis) for axis in axes]
            yield picture._replace(marks=[*picture.marks, *posed])


def _axes(K: Any, pose: dict[str, Any], diameter: float) -> tuple[tuple[str, Pair, Pair], ...]:
    """Returns the axes of an object as lines in red, lime and blue.

    Each axis is half as long as the object. The result is empty unless all axes are in front of the camera.
    """
    ends = np.vstack([np.zeros(3), np.eye(3) * diameter / 2])
    seen = ends @ np.reshape(pose["cam_R_m2c"], (3, 3)).T + pose["cam_t_m2c"]
    if (seen[:, 2] <= 0).any():
        return ()
    # BOP's coordinates start at the centre of the first pixel; the contact sheet's coordinates start at the pixel's
    # corner.
    u, v = ((seen @ K.T)[:, :2] / seen[:, 2:] + 0.5).T.tolist()
    start = (u[0], v[0])
    return tuple((color, start, (u[i], v[i])) for i, color in enumerate(("red", "lime", "blue"), 1))


def _mot(place: Path) -> Iterator[LabelledPicture]:
    for labels in sorted(place.glob("*/gt/gt.txt")):
        boxes: dict[int, list[Mark]] = {}
        for line in labels.read_text().splitlines():
            frame, track, left, top, width, height = _numbers(line, labels, ",")[:6]
            # MOT counts left and top from 1.
            ends = (left - 1, top - 1, left - 1 + width, top - 1 + height)
            boxes.setdefault(int(frame), []).append(_box(f"track {track:g}", int(track), ends))
        for picture in sorted((labels.parent.parent / "img1").glob("*.png")):
            name = picture.relative_to(place).as_posix()
            yield LabelledPicture(name, _size(picture), boxes.get(int(picture.stem), []))


def _kitti(place: Path) -> Iterator[LabelledPicture]:
    names: dict[str, int] = {}
    for labels in sorted(place.glob("object/training/label_2/*.txt")):
        marks = []
        for name, *words in (line.split() for line in labels.read_text().splitlines()):
            left, top, right, bottom = _numbers(" ".join(words[3:7]), labels)
            # KITTI's right and bottom are the coordinates of the last pixel.
            marks.append(_box(name, names.setdefault(name, len(names)), (left, top, right + 1, bottom + 1)))
        picture = labels.parent.parent / "image_2" / f"{labels.stem}.png"
        yield LabelledPicture(picture.relative_to(place).as_posix(), _size(picture), marks)


def _panoptic(place: Path) -> Iterator[LabelledPicture]:
    data = json.loads((place / "annotations/panoptic.json").read_bytes())
    names = {one["id"]: one["name"] for one in data["categories"]}
    files = {image["id"]: image for image in data["images"]}
    for one in data["annotations"]:
        image, marks = files[one["image_id"]], []
        for part in one["segments_info"]:
            x, y, width, height = part["bbox"]
            marks.append(_box(names[part["category_id"]], part["category_id"], (x, y, x + width, y + height)))
        size = (image["width"], image["height"])
        yield LabelledPicture(
            f"images/{image['file_name']}", size, marks, f"panoptic/{one['file_name']}", has_ids=True
        )


def _semantic(place: Path) -> Iterator[LabelledPicture]:
    for picture in sorted(place.glob("images/**/*.png")):
        name = picture.relative_to(place / "images").as_posix()
        yield LabelledPicture(f"images/{name}", _size(picture), [], f"color/{name}")


def _replicator(place: Path) -> Iterator[LabelledPicture]:
    for picture in sorted(place.glob("**/rgb_*.png")):
        number = picture.stem.removeprefix("rgb_")
        start = picture.parent / "bounding_box_2d_tight"
        classes = json.loads(Path(f"{start}_labels_{number}.json").read_bytes())
        marks = []
        for row in np.load(f"{start}_{number}.npy", allow_pickle=False):
            ends = [row[name] for name in ("x_min", "y_min", "x_max", "y_max")]
            marks.append(_box(classes[str(row["semanticId"])]["class"], int(row["semanticId"]), ends))
        over = picture.parent / f"instance_segmentation_{number}.png"
        name, mask = (path.relative_to(place).as_posix() for path in (picture, over))
        yield LabelledPicture(name, _size(picture), marks, mask)


MARKERS: dict[str, Callable[[Path], Iterator[LabelledPicture]]] = {
    "annotations/instances.json": _coco,
    "data.yaml": _yolo,
    "*/*/scene_gt.json": _bop,
    "*/gt/gt.txt": _mot,
    "object/training/label_2": _kitti,
    "annotations/panoptic.json": _panoptic,
    "labelIds": _semantic,
    "**/rgb_*.png": _replicator,
}
"""Files that identify the format of a data set, with the readers of its labels."""
