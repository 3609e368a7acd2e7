"""BOP: objects and their poses in millimetres.

Source: the BOP toolkit's docs/bop_datasets_format.md.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ..annotations.labels import Label, Region
from ..arguments import as_number, product
from ..camera import Camera
from ..errors import CameraError, SettingsError, nearest
from ..notices import warn_all
from .bop_models import MILLIMETRES, QUARTER_TURN, ModelCatalogue, models, scene
from .coco import segmentation
from .lost import DEPTH_SCALES, check_depth_scale, depth_units
from .per_world import in_world
from .plan import NO_LENSES, Format, Index, Made, Plan, Record, Shot, k_with_integer_centers, png

__all__ = ["FORMAT"]

OPTIONS = {"split": "train_pbr", "scene": 0, "depth_scale": None, "model_ids": None}
SEEN = 0.1
"""Minimum visible fraction of an object in the BOP evaluation."""


def check(plan: Plan) -> None:
    """Raises `CameraError` for cameras with a lens, and `SettingsError` for invalid options."""
    for number, view in enumerate(plan.shots):
        if view.camera.model != "pinhole":
            raise CameraError(
                f"camera {number} has lens model {view.camera.model}, but BOP supports only pinholes; {NO_LENSES}",
                code="unsupported_camera",
            )
    check_depth_scale(plan.options["depth_scale"])
    given = plan.options["model_ids"]
    if given is None:
        return
    if not isinstance(given, Mapping) or not all(
        isinstance(name, str) and isinstance(as_number(number), int) and number > 0
        for name, number in given.items()
    ):
        raise SettingsError(
            f'model_ids must map categories or object names to whole numbers from 1, as in {{"mug": 5}}; got {given!r}',
            code="wrong_type",
        )
    if len(set(given.values())) < len(given):
        raise SettingsError(f"model_ids has the same id for two names: {dict(given)}", code="duplicate_name")
    known = set(plan.categories.values()) | {item.name for item in plan.objects}
    for name in given:
        if name not in known:
            raise SettingsError(
                nearest("category or object in model_ids", name, sorted(known)), code="unknown_name"
            )


def make(plan: Plan, number: int) -> Made:
    """Creates an image with its depth and masks, and the image's rows of the JSON files.

    The rows belong to scene_camera, scene_gt and scene_gt_info.
    """
    world, number = in_world(plan, number)
    shot = scene(plan, world).shot(number)
    own = models(shot.plan)
    frame = shot.render(["color", "depth", "instance"])
    base = base_of(plan, world)
    depth, scale, loss = depth_units(frame["depth"], plan.options["depth_scale"])
    made = {f"{base}/rgb/{number:06d}.png": frame.to_png(), f"{base}/depth/{number:06d}.png": png(depth)}
    poses, info, coco = [], [], []
    known: Record = {}
    for place, item in enumerate(shot.labels(frame["instance"])):
        amodal = item.in_picture(item.amodal_mask)
        mask = f"{number:06d}_{place:06d}.png"
        made[f"{base}/mask/{mask}"] = png(amodal.astype(np.uint8) * 255)
        made[f"{base}/mask_visib/{mask}"] = png(item.in_picture(item.visible_mask).astype(np.uint8) * 255)
        model = own.of_object[item.object]
        known.setdefault(str(model), own.record_of(shot.plan, item.object))
        if item.visible_pixels:
            coco.append(annotation(item, model))
        poses.append(pose(shot, item, model))
        info.append(
            {
                "bbox_obj": box(item.amodal_box if item.visible_pixels else None),
                "bbox_visib": box(item.visible_box),
                "px_count_all": item.amodal_pixels,
                "px_count_valid": int(np.count_nonzero(amodal & (depth > 0))),
                "px_count_visib": item.visible_pixels,
                "visib_fract": item.visible_fraction,
            }
        )
    camera = {
        "cam_K": k_with_integer_centers(shot.camera).ravel().tolist(),
        "depth_scale": scale,
        "cam_R_w2c": shot.camera.R.ravel().tolist(),
        "cam_t_w2c": (shot.camera.t * MILLIMETRES).tolist(),
    }
    return made, {
        "camera": camera,
        "gt": poses,
        "gt_info": info,
        "coco": coco,
        **({} if plan.recipe is None else {"models": known}),
        "size": shot.camera.size,
        **loss,
    }


def box(pixels: Region | None) -> list[int]:
    """Returns a box of `pixels` for scene_gt_info.json: [x, y, width - 1, height - 1].

    (x, y) is the top left pixel; the other values are the distances between the first and last pixel centres. The
    result is [-1, -1, -1, -1] if `pixels` is None.

    Source: `calc_2d_bbox` of the BOP toolkit's bop_toolkit_lib/misc.py, and its scripts/calc_gt_info.py.
    """
    if pixels is None:
        return [-1] * 4
    x, y, width, height = pixels
    return [x, y, width - 1, height - 1]


def annotation(item: Label, model: int) -> Record:
    """Returns the annotation of an object for scene_gt_coco.json, without its ids.

    The annotation contains the visible mask, and the amodal box within the image.
    """
    x, y, width, height = item.amodal_box
    left, top = max(x, 0), max(y, 0)
    right, bottom = min(x + width, item.size[0]), min(y + height, item.size[1])
    return {
        "category_id": model,
        "iscrowd": 0,
        "area": item.visible_pixels,
        "bbox": [left, top, right - left, bottom - top],
        "bbox_visib": list(item.visible_box or ()),
        "segmentation": segmentation(item, "rle"),
        "width": item.size[0],
        "height": item.size[1],
        "ignore": item.visible_fraction < SEEN,
    }


def pose(shot: Shot, item: Label, model: int) -> Record:
    """Returns the pose model_to_camera.

    The pose consists of the rotation of the object's box, and the origin of the object's mesh.
    """
    camera, origin = shot.camera, shot.world.objects[item.object].matrix[:3, 3]
    return {
        "cam_R_m2c": product(camera.R, item.box3d.rotation).ravel().tolist(),
        "cam_t_m2c": (product(camera.R, origin - camera.C) * MILLIMETRES).tolist(),
        "obj_id": model,
    }


def base_of(plan: Plan, world: int) -> str:
    """Returns the folder of a world's scene."""
    return f"{plan.options['split']}/{int(plan.options['scene']) + world:06d}"


def index(plan: Plan, records: Callable[..., Iterator[Record]]) -> Index:
    """Creates the JSON files of the scenes, and the models with their JSON files.

    The data set contains one scene for each world.
    """
    catalogue = ModelCatalogue(plan, records())
    warn_all(catalogue.notices)
    views = len(plan.shots) // len(catalogue.ids)
    for world, (ids, turns) in enumerate(zip(catalogue.ids, catalogue.turns, strict=True)):

        def own(first: int = world * views) -> Iterator[Record]:
            return records(first, first + views)

        base = base_of(plan, world)
        for name, key in (("scene_camera", "camera"), ("scene_gt", "gt"), ("scene_gt_info", "gt_info")):
            yield f"{base}/{name}.json", rows(own, key, ids, turns)
        yield (
            f"{base}/scene_gt_coco.json",
            coco_rows(own, ids, [one.id for one in catalogue.all], modal=False),
        )
        yield (
            f"{base}/scene_gt_coco_modal.json",
            coco_rows(own, ids, [one.id for one in catalogue.all], modal=True),
        )
    first = plan.shots[0].camera
    yield "camera.json", [json.dumps(camera_json(first), indent=2).encode()]
    information = {}
    for model, row, mesh in catalogue.meshes(plan):
        information[str(model)] = row
        yield f"models/obj_{model:06d}.ply", mesh
    yield "models/models_info.json", [json.dumps(information, indent=2).encode()]


def rows(
    records: Callable[[], Iterator[Record]], key: str, ids: Mapping[int, int], turns: Mapping[int, int]
) -> Iterator[bytes]:
    """Iterates over the text of a JSON object with a row per image.

    In the rows of scene_gt, the model numbers are replaced by the ids of the data set, `ids`, and poses refer to the
    axes of the data set's model, which differ from the object's by a number of quarter turns.
    """
    yield b"{"
    for number, record in enumerate(records()):
        row = record[key]
        if key == "gt":
            row = [{**turned_pose(one, turns[one["obj_id"]]), "obj_id": ids[one["obj_id"]]} for one in row]
        yield (b",\n" if number else b"\n") + f'"{number}":{_compact(row)}'.encode()
    yield b"\n}\n"


def _compact(value: Any) -> str:
    """Returns JSON without spaces.

    For small images, the JSON is a large part of the data set.
    """
    return json.dumps(value, separators=(",", ":"))


def turned_pose(row: Record, turns: int) -> Record:
    """Returns a row of scene_gt for a model that has been rotated by `turns` quarter turns."""
    rotation = np.reshape(row["cam_R_m2c"], (3, 3))
    for _ in range(turns):
        rotation = product(rotation, QUARTER_TURN.T)
    return {**row, "cam_R_m2c": rotation.ravel().tolist()}


def coco_rows(
    records: Callable[[], Iterator[Record]], ids: Mapping[int, int], every: Sequence[int], modal: bool
) -> Iterator[bytes]:
    """Iterates over the text of the scene in COCO's format.

    Boxes are around the visible part of an object if `modal`, otherwise around the whole object.

    Source: the BOP toolkit's scripts/calc_gt_coco.py.
    """
    yield b'{"info": {"description": "made by raycam"}, "licenses": [],\n"categories": '
    kinds = [{"id": model, "name": str(model), "supercategory": "object"} for model in every]
    yield _compact(kinds).encode()
    yield b',\n"images": ['
    for number, record in enumerate(records()):
        width, height = record["size"]
        image = {"id": number, "file_name": f"rgb/{number:06d}.png", "width": width, "height": height}
        yield (b",\n" if number else b"\n") + _compact(image).encode()
    yield b'],\n"annotations": ['
    count = 0
    for number, record in enumerate(records()):
        for one in record["coco"]:
            count += 1
            whole = {"id": count, "image_id": number, **one, "category_id": ids[one["category_id"]]}
            seen = whole.pop("bbox_visib")
            if modal:
                whole["bbox"] = seen
            yield (b",\n" if count > 1 else b"\n") + _compact(whole).encode()
    yield b"]}\n"


def camera_json(camera: Camera) -> Record:
    """Returns camera.json, which describes the first camera.

    The file scene_camera.json contains the cameras of all images.
    """
    k = k_with_integer_centers(camera)
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


FORMAT = Format(make, index, check, OPTIONS, many_worlds=True, posed=True)
