"""Writes SemanticKITTI: lidar scans with point labels in the layout of KITTI's odometry.

Source: semantic-kitti.org, "Dataset"; `semantic-kitti-api`; the development kit of KITTI's odometry
benchmark.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, product, real, whole
from ..camera import Camera
from ..errors import CameraError, SettingsError, nearest
from ..lidar import Lidar
from .lidars import check_rigs, lidars_of, pose_of, scan_lidar
from .plan import NO_LENSES, Format, Index, Made, Plan, Record, Shot, k_with_integer_centers, matrix_text

__all__ = ["FORMAT"]

OPTIONS: dict[str, Any] = {"lidar": None, "sequence": "00", "labels": None, "fps": 10.0}
MAX_ID = 0xFFFF
"""The greatest label, and the greatest number of an instance."""
UNLABELLED = 0
CAMERA_FROM_LIDAR = [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]
"""The rotation of a camera that looks along the lidar's x axis, with the lidar's z axis up."""


def check(plan: Plan) -> None:
    """Raises an error for views that SemanticKITTI does not support and for invalid options.

    All views must belong to rigs that have the lidar. The first camera, if any, must be a pinhole camera without skew.
    """
    check_rigs(plan, "semantickitti")
    for frame in plan.rigs:
        chosen_lidar(plan, frame[0])
        camera = plan.shots[frame[0]].optional_camera
        if camera is None:
            continue
        if camera.model != "pinhole" or camera.K[0, 1] != 0.0:
            raise CameraError(
                f"camera {frame[0]} has a lens model or skew, which KITTI does not support; {NO_LENSES}",
                code="unsupported_camera",
            )
    real("fps", plan.options["fps"], 0, above=True, what="a number of frames per second")
    sequence = plan.options["sequence"]
    if not (isinstance(sequence, str) and sequence.isalnum()):
        raise SettingsError(f'sequence is {sequence!r}, expected a name such as "00"', code="invalid_value")
    label_ids(plan)
    if len(plan.objects) > MAX_ID:
        raise SettingsError(
            f"the world has {len(plan.objects)} objects; SemanticKITTI supports at most {MAX_ID}",
            code="cannot_write",
        )


def chosen_lidar(plan: Plan, number: int) -> Lidar:
    """Returns the lidar of a view's rig.

    Raises `SettingsError` if the rig has no lidar, if the option `lidar` is an unknown name, or if the rig
    has several lidars and the option is missing.
    """
    lidars, name = lidars_of(plan.shots[number]), plan.options["lidar"]
    if name is None and len(lidars) == 1:
        return next(iter(lidars.values()))
    if not lidars:
        raise SettingsError(f"the rig of view {number} has no lidar", code="missing_value")
    if name is None:
        raise SettingsError(
            f"the rig has {len(lidars)} lidars ({', '.join(lidars)}); select one with lidar=NAME",
            code="missing_value",
        )
    if name not in lidars:
        raise SettingsError(nearest("lidar", name, list(lidars)), code="unknown_name")
    return lidars[name]


def label_ids(plan: Plan) -> dict[str, int]:
    """Returns the label of each category.

    Raises `SettingsError` for unknown categories and for ids that do not fit into 16 bits.
    """
    given = plan.options["labels"] or {}
    for name in given:
        if name not in plan.category_ids:
            raise SettingsError(nearest("category", name, list(plan.category_ids)), code="unknown_name")
    found = {**plan.category_ids, **given}
    for name, number in found.items():
        whole(f"the label id of {name!r}", number, 0, MAX_ID)
    return found


def make(plan: Plan, number: int) -> Made:
    """Creates a scan, its labels and, if the rig has cameras, the image of the first camera."""
    view = plan.rigs[number][0]
    shot, lidar = plan.shot(view), chosen_lidar(plan, view)
    scan = scan_lidar(plan, view, lidar)
    reflectance = scan["intensity"].astype(np.float32) / np.float32(255.0)
    points = np.column_stack([scan.deskewed(0.0).astype("<f4"), reflectance]).astype("<f4")
    base, name = f"sequences/{plan.options['sequence']}", f"{number:06d}"
    files = {
        f"{base}/velodyne/{name}.bin": points.tobytes(),
        f"{base}/labels/{name}.label": labels(shot, scan["instance"]).astype("<u4").tobytes(),
    }
    if shot.view.has_camera:
        camera = shot.camera
        files[f"{base}/image_2/{name}.png"] = shot.render(["color"]).to_png()
    else:
        camera = nominal_camera(lidar)
    time = shot.time if shot.time is not None else number / float(plan.options["fps"])
    record: Record = {"pose": world_from_camera(camera).tolist(), "time": time}
    if number == 0:
        record["calib"] = calibration(camera, lidar)
    return files, record


def labels(shot: Shot, instance: npt.NDArray[np.int32]) -> npt.NDArray[np.uint32]:
    """Returns the labels [n] of points.

    The low 16 bits contain the category's label. The high bits contain 1 + the object's number.
    """
    ids, plan = label_ids(shot.plan), shot.plan
    known = set(plan.labelled_of(shot.objects))
    semantic = [ids[item.category or "object"] if item.id in known else UNLABELLED for item in shot.objects]
    table = np.array([*semantic, UNLABELLED], np.uint32)
    number = np.where(instance >= 0, instance + 1, 0).astype(np.uint32)
    return table[instance] | (number << np.uint32(16))


def world_from_camera(camera: Camera) -> Floats:
    """Returns the pose world_from_camera [4, 4] of a camera."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = camera.R.T, camera.C
    return matrix


def nominal_camera(lidar: Lidar) -> Camera:
    """Returns camera 0 of a rig without cameras.

    The camera is at the lidar, looks along the lidar's x axis, and has P = [I 0]. KITTI's poses and calibration require
    this camera's axes.
    """
    pose = pose_of(lidar)
    turn = product(np.array(CAMERA_FROM_LIDAR), pose[:3, :3].T)
    return Camera(np.eye(3), turn, pose[:3, 3], (1, 1), pixel_center="integer")


def calibration(camera: Camera, lidar: Lidar) -> str:
    """Returns the text of calib.txt.

    P0 to P3 are all the projection of the first camera. Tr is the transform camera_from_lidar.
    """
    projection = np.column_stack([k_with_integer_centers(camera), np.zeros(3)])
    pose = pose_of(lidar)
    turn = product(camera.R, pose[:3, :3])
    place = product(camera.R, pose[:3, 3] - camera.C)
    rows = [(f"P{i}", projection) for i in range(4)] + [("Tr", np.column_stack([turn, place]))]
    return "".join(f"{name}: {matrix_text(matrix)}\n" for name, matrix in rows)


def units(plan: Plan) -> int:
    """The number of poses of the rig."""
    return max(1, len(plan.rigs))


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates calib.txt, poses.txt, times.txt and the names of the labels.

    The poses are relative to the pose of the first camera. They are written twice: as poses.txt of the sequence, as in
    SemanticKITTI, and in the folder poses, as in KITTI's odometry.
    """
    base = f"sequences/{plan.options['sequence']}"
    first = next(records())
    start = np.array(first["pose"])

    def poses() -> Iterator[bytes]:
        for record in records():
            pose = np.array(record["pose"])
            turn = product(start[:3, :3].T, pose[:3, :3])
            place = product(start[:3, :3].T, pose[:3, 3] - start[:3, 3])
            yield (matrix_text(np.column_stack([turn, place])) + "\n").encode()

    yield f"{base}/calib.txt", [first["calib"].encode()]
    yield f"{base}/poses.txt", poses()
    yield f"poses/{plan.options['sequence']}.txt", poses()
    yield f"{base}/times.txt", (f"{record['time'] - first['time']:.9e}\n".encode() for record in records())
    names = {UNLABELLED: "unlabeled", **{number: name for name, number in label_ids(plan).items()}}
    lines = ["labels:", *(f"  {number}: {json.dumps(name)}" for number, name in sorted(names.items())), ""]
    yield "labels.yaml", ["\n".join(lines).encode()]


FORMAT = Format(make, index, check, OPTIONS, units=units, posed=True, writes_lidars=True)
