"""BOP: objects and their poses in millimetres. Source: the BOP toolkit's docs/bop_datasets_format.md."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ..arrays import Floats
from ..camera import Camera
from ..errors import CameraError, SettingsError
from ..labels import Label, box3d
from .coco import segmentation
from .plan import Format, Index, Made, Plan, Record, Shot, png, whole_centers

__all__ = ["FORMAT"]

OPTIONS = {"split": "train_pbr", "scene": 0, "depth_scale": None}
DEPTH_SCALES = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]
MILLIMETRES = 1000.0
MANY = 20_000
PAIRS = 32_768
"""Pairs of vertices that are compared at a time: a small part of the memory that a picture takes."""


def check(plan: Plan) -> None:
    """BOP has pinhole cameras without skew, of one size."""
    for number, view in enumerate(plan.shots):
        if view.camera.model != "pinhole":
            raise CameraError(
                f"camera {number} has a lens ({view.camera.model}); BOP has pinhole cameras alone"
            )
    scale = plan.options["depth_scale"]
    if scale is not None and not (isinstance(scale, int | float) and scale > 0):
        raise SettingsError(f"depth_scale is {scale!r}, expected millimetres per unit, more than 0")


class Models:
    """The distinct shapes among the labelled objects: the same mesh with the same scale is the same model."""

    def __init__(self, plan: Plan) -> None:
        self.of_object: dict[int, int] = {}
        """The BOP id of each object, from 1."""
        self.vertices: dict[int, tuple[Floats, Floats]] = {}
        """Each model's vertices [n, 3] in millimetres, and its triangles [m, 3]."""
        known: dict[tuple[int, bytes], int] = {}
        for number in plan.labelled:
            item = plan.objects[number]
            shape = box3d(plan.world, number).rotation.T @ item.matrix[:3, :3]
            size = np.abs(shape).max()
            key = (item.mesh, f"{size:.9g}".encode() + ((shape / size).round(9) + 0.0).tobytes())
            self.of_object[number] = known.setdefault(key, len(known) + 1)
        self.first = {model: number for number, model in reversed(self.of_object.items())}
        """An object of each model."""


_models: WeakKeyDictionary[Plan, Models] = WeakKeyDictionary()


def models(plan: Plan) -> Models:
    """The models of a plan, found once."""
    if plan not in _models:
        _models[plan] = Models(plan)
    return _models[plan]


def make(plan: Plan, number: int) -> Made:
    """Colour, depth and masks of a picture, and its rows of scene_camera, scene_gt and scene_gt_info."""
    shot = plan.shot(number)
    frame = shot.render(["color", "depth", "instance"])
    base = f"{plan.options['split']}/{int(plan.options['scene']):06d}"
    depth, scale = depth_units(frame["depth"], plan.options["depth_scale"])
    made = {f"{base}/rgb/{number:06d}.png": frame.to_png(), f"{base}/depth/{number:06d}.png": png(depth)}
    poses, info, coco = [], [], []
    for place, item in enumerate(shot.labels(frame["instance"])):
        amodal = item.in_picture(item.amodal_mask)
        mask = f"{number:06d}_{place:06d}.png"
        made[f"{base}/mask/{mask}"] = png(amodal.astype(np.uint8) * 255)
        made[f"{base}/mask_visib/{mask}"] = png(item.in_picture(item.visible_mask).astype(np.uint8) * 255)
        if item.visible_pixels:
            coco.append(annotation(item, models(plan).of_object[item.object]))
        poses.append(pose(shot, item, models(plan).of_object[item.object]))
        info.append(
            {
                "bbox_obj": list(item.amodal_box),
                "bbox_visib": list(item.visible_box or (-1, -1, -1, -1)),
                "px_count_all": item.amodal_pixels,
                "px_count_valid": int(np.count_nonzero(amodal & (depth > 0))),
                "px_count_visib": item.visible_pixels,
                "visib_fract": item.visible_fraction,
            }
        )
    camera = {
        "cam_K": whole_centers(shot.camera).ravel().tolist(),
        "depth_scale": scale,
        "cam_R_w2c": shot.camera.R.ravel().tolist(),
        "cam_t_w2c": (shot.camera.t * MILLIMETRES).tolist(),
    }
    return made, {"camera": camera, "gt": poses, "gt_info": info, "coco": coco, "size": shot.camera.size}


def annotation(item: Label, model: int) -> Record:
    """One object of scene_gt_coco.json, without its ids: the visible mask and what bounds it."""
    x, y, width, height = item.visible_box or (0, 0, 0, 0)
    return {
        "category_id": model,
        "iscrowd": 0,
        "area": item.visible_pixels,
        "bbox": [x, y, width, height],
        "segmentation": segmentation(item, "rle"),
        "width": item.size[0],
        "height": item.size[1],
    }


def pose(shot: Shot, item: Label, model: int) -> Record:
    """model_to_camera: the rotation of the object's box, and where the origin of its mesh is."""
    camera, origin = shot.camera, shot.world.objects[item.object].matrix[:3, 3]
    return {
        "cam_R_m2c": (camera.R @ item.box3d.rotation).ravel().tolist(),
        "cam_t_m2c": (camera.R @ (origin - camera.C) * MILLIMETRES).tolist(),
        "obj_id": model,
    }


def depth_units(depth: Any, scale: float | None) -> tuple[Any, float]:
    """Depth as uint16, 0 for none and for what is out of reach, and how many millimetres its unit is.

    Where no unit is given, it is the finest of a row that reaches the farthest surface.
    """
    with np.errstate(invalid="ignore"):
        millimetres = np.where(np.isfinite(depth), depth.astype(np.float64) * MILLIMETRES, 0.0)
    farthest = millimetres.max(initial=0.0)
    fitting = [unit for unit in DEPTH_SCALES if farthest <= 65535 * unit]
    unit = float(scale if scale is not None else (fitting or DEPTH_SCALES[-1:])[0])
    steps = np.rint(millimetres / unit)
    return np.where(steps <= 65535, steps, 0).astype(np.uint16), unit


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """The JSON files of the scene and of the models, and the models."""
    base = f"{plan.options['split']}/{int(plan.options['scene']):06d}"
    for name, key in (("scene_camera", "camera"), ("scene_gt", "gt"), ("scene_gt_info", "gt_info")):
        yield f"{base}/{name}.json", rows(records, key)
    yield f"{base}/scene_gt_coco.json", coco_rows(plan, records)
    first = plan.shots[0].camera
    yield "camera.json", [json.dumps(camera_json(first), indent=2).encode()]
    corners, ids = plan.world.triangles(), plan.world.triangle_ids()[:, 0]
    information = {}
    for model, number in sorted(models(plan).first.items()):
        vertices, triangles = model_mesh(plan, number, corners[ids == number])
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        information[str(model)] = {
            "diameter": diameter(vertices),
            **{f"min_{axis}": float(value) for axis, value in zip("xyz", low, strict=True)},
            **{f"size_{axis}": float(value) for axis, value in zip("xyz", high - low, strict=True)},
            "name": plan.objects[number].name,
        }
        yield f"models/obj_{model:06d}.ply", ply(vertices, triangles)
    yield "models/models_info.json", [json.dumps(information, indent=2).encode()]


def rows(records: Callable[[], Iterator[Record]], key: str) -> Iterator[bytes]:
    """An object with a row for each picture."""
    yield b"{"
    for number, record in enumerate(records()):
        yield (b",\n" if number else b"\n") + f'"{number}": {json.dumps(record[key])}'.encode()
    yield b"\n}\n"


def coco_rows(plan: Plan, records: Callable[[], Iterator[Record]]) -> Iterator[bytes]:
    """The scene as COCO has it. Source: the BOP toolkit's scripts/calc_gt_coco.py."""
    yield b'{"info": {"description": "made by raycam"}, "licenses": [],\n"categories": '
    ids = sorted(set(models(plan).of_object.values()))
    yield json.dumps([{"id": model, "name": str(model), "supercategory": "object"} for model in ids]).encode()
    yield b',\n"images": ['
    for number, record in enumerate(records()):
        width, height = record["size"]
        image = {"id": number, "file_name": f"rgb/{number:06d}.png", "width": width, "height": height}
        yield (b",\n" if number else b"\n") + json.dumps(image).encode()
    yield b'],\n"annotations": ['
    count = 0
    for number, record in enumerate(records()):
        for one in record["coco"]:
            count += 1
            whole = {"id": count, "image_id": number, **one}
            yield (b",\n" if count > 1 else b"\n") + json.dumps(whole).encode()
    yield b"]}\n"


def camera_json(camera: Camera) -> Record:
    """What the first camera is; those of all pictures are in scene_camera.json."""
    k = whole_centers(camera)
    width, height = camera.size
    return {
        "cx": k[0, 2],
        "cy": k[1, 2],
        "depth_scale": DEPTH_SCALES[0],
        "fx": k[0, 0],
        "fy": k[1, 1],
        "height": height,
        "width": width,
    }


def model_mesh(plan: Plan, number: int, corners: Floats) -> tuple[Floats, Any]:
    """Vertices in millimetres, in the axes that the pose turns, and triangles of an object."""
    rotation, origin = box3d(plan.world, number).rotation, plan.objects[number].matrix[:3, 3]
    vertices, triangles = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return (vertices - origin) @ rotation * MILLIMETRES, triangles.reshape(-1, 3)


def diameter(vertices: Floats) -> float:
    """The largest distance between two vertices: those that lie too near to the middle cannot have it.

    Exact, unless more than 20,000 are left, as of a fine ball: then the largest extent along 4096 directions.
    """
    center = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    radius = np.linalg.norm(vertices - center, axis=1)
    reach = radius.max()
    at_least = np.linalg.norm(vertices - vertices[radius.argmax()], axis=1).max()
    outer = vertices[radius >= (at_least - reach) * (1 - 1e-9)]
    if len(outer) > MANY:
        directions = np.random.default_rng(0).normal(size=(4096, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        return max(float(np.ptp(outer @ direction)) for direction in directions)
    largest, step = 0.0, max(1, PAIRS // len(outer))
    for start in range(0, len(outer), step):
        squares = sum(
            (outer[start : start + step, None, axis] - outer[None, start:, axis]) ** 2 for axis in range(3)
        )
        largest = max(largest, float(np.max(squares)))
    return float(np.sqrt(largest))


def ply(vertices: Floats, triangles: Any) -> list[bytes]:
    """A binary PLY file."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(triangles), dtype=[("n", "u1"), ("i", "<i4", 3)])
    faces["n"], faces["i"] = 3, triangles
    return [header.encode(), vertices.astype("<f4").tobytes(), faces.tobytes()]


FORMAT = Format(make, index, check, OPTIONS, posed=True)
