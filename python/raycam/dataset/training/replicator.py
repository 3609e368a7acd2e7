"""Writes the layout of NVIDIA Replicator's BasicWriter.

For each image, the folder contains one file of each kind.

Sources: the public converters that read the layout; USD's camera, UsdGeomCamera.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from ...annotations.labels import Label
from ...arguments import product
from ...camera import Camera
from ...errors import Notice
from ..plan import Format, Index, Made, Plan, Record, k_with_half_centers, png
from .semantic import pascal_palette

__all__ = ["BOX", "BOX_3D", "FORMAT"]

BOX = np.dtype(
    [
        ("semanticId", "<u4"),
        ("x_min", "<i4"),
        ("y_min", "<i4"),
        ("x_max", "<i4"),
        ("y_max", "<i4"),
        ("occlusionRatio", "<f4"),
    ]
)
"""A row of `bounding_box_2d_tight`; x_max and y_max are one pixel beyond the last pixel, so that differences are sizes.
"""
BOX_3D = np.dtype(
    [
        ("semanticId", "<u4"),
        *((f"{axis}_{end}", "<f4") for end in ("min", "max") for axis in "xyz"),
        ("transform", "<f4", (4, 4)),
        ("occlusionRatio", "<f4"),
    ]
)
"""A row of `bounding_box_3d`: extents in the axes of the box, and world_from_box for row vectors."""
APERTURE = 20.955
"""Film width in millimetres, as for USD cameras."""
CLIPPING = (0.01, 1e6)
"""Clipping planes of `cameraProjection` in metres; raycam itself has no clipping planes."""
OPENGL = np.diag([1.0, -1.0, -1.0])


def npy(array: npt.NDArray[Any]) -> bytes:
    """Encodes an array as `.npy`."""
    memory = io.BytesIO()
    np.save(memory, array, allow_pickle=False)
    return memory.getvalue()


def as_json(value: Any) -> bytes:
    """Encodes plain values as JSON."""
    return json.dumps(value).encode()


def color_of(number: int) -> tuple[int, int, int, int]:
    """Returns a distinct opaque colour for each number from 0.

    The bits of the number are distributed to the channels, lowest bits first.
    """
    color = [0, 0, 0, 255]
    for bit in range(24):
        color[bit % 3] |= (number + 1 >> bit & 1) << 7 - bit // 3
    return color[0], color[1], color[2], color[3]


def camera_params(camera: Camera) -> dict[str, Any]:
    """Returns the camera in USD's conventions and in raycam's conventions.

    USD's conventions are millimetres, axes x right, y up, z backward, and row vectors.
    """
    width, height = camera.size
    K = k_with_half_centers(camera)
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = product(OPENGL, camera.R), product(OPENGL, camera.t)
    near, far = CLIPPING
    projection = np.zeros((4, 4))
    projection[0] = [2 * K[0, 0] / width, -2 * K[0, 1] / width, 1 - 2 * K[0, 2] / width, 0]
    projection[1] = [0, 2 * K[1, 1] / height, 2 * K[1, 2] / height - 1, 0]
    projection[2, 2:] = [(far + near) / (near - far), 2 * far * near / (near - far)]
    projection[3, 2] = -1
    pixel = APERTURE / width
    own: dict[str, Any] = {"K": camera.K.tolist(), "R": camera.R.tolist(), "C": camera.C.tolist()}
    lens = camera.distortion
    own |= {
        "model": camera.model,
        "distortion": [] if lens is None else lens.tolist(),
        "pixel_center": camera.pixel_center,
    }
    return {
        "cameraAperture": [APERTURE, height * pixel * K[0, 0] / K[1, 1]],
        "cameraApertureOffset": [
            (width / 2 - K[0, 2]) * pixel,
            (K[1, 2] - height / 2) * pixel * K[0, 0] / K[1, 1],
        ],
        "cameraFocalLength": K[0, 0] * pixel,
        "cameraModel": camera.model,
        "cameraNearFar": list(CLIPPING),
        "cameraProjection": projection.T.ravel().tolist(),
        "cameraViewTransform": view.T.ravel().tolist(),
        "metersPerSceneUnit": 1.0,
        "renderProductResolution": [width, height],
        "raycam": own,
    }


def box_rows(shown: list[tuple[int, Label]]) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Returns the rows of the 2D and 3D boxes of visible objects, each with its semantic id."""
    flat, deep = np.zeros(len(shown), BOX), np.zeros(len(shown), BOX_3D)
    for row, solid, (number, item) in zip(flat, deep, shown, strict=True):
        box = item.visible_box
        assert box is not None
        x, y, w, h = box
        inside = int(np.count_nonzero(item.in_picture(item.amodal_mask)))
        hidden = 1 - item.visible_pixels / max(inside, item.visible_pixels)
        for name, value in zip(BOX.names or (), (number, x, y, x + w, y + h, hidden), strict=True):
            row[name] = value
        world_from_box = np.eye(4)
        world_from_box[:3, :3], world_from_box[:3, 3] = item.box3d.rotation, item.box3d.center
        half = item.box3d.size / 2
        values = (number, *-half, *half, world_from_box.T, hidden)
        for name, value in zip(BOX_3D.names or (), values, strict=True):
            solid[name] = value
    return flat, deep


def make(plan: Plan, number: int) -> Made:
    """Creates the files of an image, each named by its kind and the number of the image."""
    shot = plan.shot(number)
    frame = shot.render(["color", "depth", "distance", "normal", "instance"])
    instance = frame["instance"]
    shown = [item for item in shot.labels(instance) if item.visible_pixels]
    ids = {category: i for i, category in enumerate(sorted(plan.categories))}
    numbered = [(ids[shot.category(item.object)], item) for item in shown]
    semantics = np.zeros((*instance.shape, 4), dtype=np.uint8)
    semantics[instance >= 0] = (0, 0, 0, 255)
    instances = semantics.copy()
    nothing = {"(0, 0, 0, 0)": {"class": "BACKGROUND"}, "(0, 0, 0, 255)": {"class": "UNLABELLED"}}
    classes: dict[str, Any] = dict(nothing)
    paths: dict[str, Any] = {key: value["class"] for key, value in nothing.items()}
    semantics_of: dict[str, Any] = dict(nothing)
    palette = pascal_palette()
    for own, item in numbered:
        name = plan.categories[shot.category(item.object)]
        color = (*palette[(own + 1) % 256].tolist(), 255) if own < 255 else color_of(own)
        mask = instance == item.object
        semantics[mask], instances[mask] = color, color_of(item.object)
        classes[str(color)] = {"class": name}
        paths[str(color_of(item.object))] = f"/World/{item.name}"
        semantics_of[str(color_of(item.object))] = {"class": name}
    flat, deep = box_rows(numbered)
    normals = np.zeros((*instance.shape, 4), dtype=np.uint8)
    normals[..., :3] = np.rint((frame["normal"] + 1) * 127.5)
    normals[..., 3] = 255
    normals[instance < 0] = 0
    labels = as_json({str(own): {"class": plan.categories[key]} for key, own in ids.items()})
    prims = as_json([f"/World/{item.name}" for item in shown])
    end = f"{number:04d}"
    files = {
        f"rgb_{end}.png": frame.to_png(),
        f"distance_to_camera_{end}.npy": npy(frame["distance"].astype(np.float32)),
        f"distance_to_image_plane_{end}.npy": npy(frame["depth"].astype(np.float32)),
        f"normals_{end}.png": png(normals),
        f"semantic_segmentation_{end}.png": png(semantics),
        f"semantic_segmentation_labels_{end}.json": as_json(classes),
        f"instance_segmentation_{end}.png": png(instances),
        f"instance_segmentation_mapping_{end}.json": as_json(paths),
        f"instance_segmentation_semantics_mapping_{end}.json": as_json(semantics_of),
        f"camera_params_{end}.json": as_json(camera_params(shot.camera)),
    }
    for kind, rows in (("bounding_box_2d_tight", flat), ("bounding_box_3d", deep)):
        files |= {
            f"{kind}_{end}.npy": npy(rows),
            f"{kind}_labels_{end}.json": labels,
            f"{kind}_prim_paths_{end}.json": prims,
        }
    return files, {}


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Yields no index files, because all files belong to single images."""
    return iter(())


def notices(plan: Plan) -> list[Notice]:
    """Returns a notice if a camera has a lens model or skew.

    Replicator's keys describe only pinhole cameras without skew.
    """
    cameras = [view.camera for view in plan.shots]
    lenses = sorted({camera.model for camera in cameras if camera.model != "pinhole"})
    if not lenses and all(camera.K[0, 1] == 0.0 for camera in cameras):
        return []
    what = f"lens model {', '.join(lenses)}" if lenses else "skew"
    message = (
        f"replicator: the keys of camera_params_*.json cannot represent {what}; other readers project boxes and points "
        'as a pinhole camera does. The complete camera is stored under the key "raycam"; for other readers, use '
        "pinhole cameras without skew"
    )
    return [Notice(message, "not_written")]


FORMAT = Format(make, index, lambda plan: None, {}, many_worlds=True, posed=True, notices=notices)
