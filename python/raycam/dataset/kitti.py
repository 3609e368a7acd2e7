"""KITTI: detection, depth, optical flow and stereo.

Source: the development kits of the KITTI object detection 2017, depth prediction, and scene flow 2015 benchmarks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..annotations.flow import check_rectified, disparity, flow
from ..annotations.labels import Label
from ..arguments import Floats, product, real
from ..camera import Camera
from ..errors import CameraError, SettingsError
from .lost import KEY, lost
from .plan import NO_LENSES, Format, Index, Made, Plan, Record, Shot, k_with_integer_centers, matrix_text, png

__all__ = ["FORMAT"]

OPTIONS = {"baseline": None, "flow": False}
MAX_U16 = 65535 / 256
"""Maximum depth in metres, and maximum disparity in pixels."""
CLEAR, PARTLY = 0.95, 0.5
"""Thresholds of the visible fraction of an object's part in the image: above the first, the object is fully visible
(0), above the second partly occluded (1), otherwise largely occluded (2).
"""


def check(plan: Plan) -> None:
    """Raises an error unless cameras are pinholes without skew, and rigs are rectified pairs.

    Also raises an error for invalid values of the options `baseline` and `flow`.
    """
    for number, view in enumerate(plan.shots):
        if view.camera.model != "pinhole" or view.camera.K[0, 1] != 0.0:
            raise CameraError(
                f"camera {number} has a lens model or skew, which KITTI does not support; {NO_LENSES}",
                code="unsupported_camera",
            )
    baseline = plan.options["baseline"]
    if baseline is not None:
        real("baseline", baseline, 0, above=True, what="the distance to the right camera in metres")
    if plan.rigs and len(plan.rigs[0]) * len(plan.rigs) != len(plan.shots):
        raise SettingsError(
            "rigs and single cameras cannot be combined, because KITTI's images are either all stereo pairs "
            "or all single",
            code="conflicting_values",
        )
    for frame in plan.rigs:
        if baseline is not None:
            raise SettingsError(
                "baseline requires single cameras; rigs have their own baseline",
                code="conflicting_values",
            )
        if len(frame) != 2:
            raise SettingsError(
                f"KITTI requires rigs with two cameras, left and right; got a rig with {len(frame)}",
                code="wrong_shape",
            )
        check_rectified(plan.shots[frame[0]].camera, plan.shots[frame[1]].camera)
    if baseline is not None:
        for view in plan.shots:
            check_rectified(view.camera, shifted_camera(view.camera, baseline))
    if plan.options["flow"] and plan.recipe is not None:
        raise SettingsError(
            "flow connects consecutive views of one world and cannot be used with a recipe",
            code="conflicting_values",
        )
    if plan.options["flow"] and units(plan) < 2:
        raise SettingsError("flow requires at least two views", code="missing_value")


def units(plan: Plan) -> int:
    """Returns the number of images of the left camera."""
    return len(plan.rigs) or len(plan.shots)


def left_camera(plan: Plan, number: int) -> Shot:
    """Returns the shot of the left camera, which is the first camera of a rig."""
    return plan.shot(plan.rigs[number][0] if plan.rigs else number)


def make(plan: Plan, number: int) -> Made:
    """Creates an image's files in `object/training/` and `scene_flow/training/`.

    `object/training/` contains colour, depth, labels and calibration; `scene_flow/training/` contains flow
    and disparity.
    """
    shot = left_camera(plan, number)
    frame = shot.render(["color", "depth", "instance"])
    picture = frame.to_png()
    base, name = "object/training", f"{number:06d}"
    depth = frame["depth"].astype(np.float64)
    losses = [loss_of("depth", f"depth beyond {MAX_U16:.6g} m", depth)]
    lines = [line(shot, item) for item in shot.labels(frame["instance"]) if item.visible_pixels]
    made = {
        f"{base}/image_2/{name}.png": picture,
        f"{base}/depth_2/{name}.png": png(fixed_point_u16(depth)),
        f"{base}/label_2/{name}.txt": "".join(lines).encode(),
    }
    right = right_camera(plan, shot, number)
    made[f"{base}/calib/{name}.txt"] = calibration(shot.camera, right).encode()
    other = None if right is None else shot.render(["color"], right, index=1).to_png()
    if right is not None and other is not None:
        made[f"{base}/image_3/{name}.png"] = other
    if plan.options["flow"] or right is not None:
        base = "scene_flow/training"
        made[f"{base}/image_2/{name}_10.png"] = picture
        if right is not None and other is not None:
            made[f"{base}/image_3/{name}_10.png"] = other
            files, loss = disparities(shot, right, base, name)
            made |= files
            losses.append(loss)
        if plan.options["flow"] and number + 1 < units(plan):
            following = left_camera(plan, number + 1)
            made[f"{base}/image_2/{name}_11.png"] = following.render(["color"]).to_png()
            files, loss = flows(shot, following, base, name)
            made |= files
            losses.append(loss)
    pose = matrix_text(np.column_stack([shot.camera.R.T, shot.camera.C]))
    counts = {what: count for loss in losses for what, count in loss.get(KEY, {}).items()}
    return made, {"pose": pose, **({KEY: counts} if counts else {})}


def right_camera(plan: Plan, shot: Shot, number: int) -> Camera | None:
    """Returns the right camera of the stereo pair; None without a rig and without a baseline.

    The camera is the rig's second camera, or the shot's camera shifted by the option `baseline`.
    """
    if plan.rigs:
        return plan.shots[plan.rigs[number][1]].camera
    baseline = plan.options["baseline"]
    return None if baseline is None else shifted_camera(shot.camera, baseline)


def shifted_camera(camera: Camera, baseline: float) -> Camera:
    """Returns the camera shifted to the right by `baseline` metres."""
    return camera.at_pose(camera.R, camera.C + baseline * camera.R[0])


def line(shot: Shot, item: Label) -> str:
    """Returns one line of label_2.

    The line's bounding box is rotated only about the camera's y axis.
    """
    height, width, length, location, turn = upright_box(
        shot.camera, item.box3d.corners, item.box3d.rotation, shot.world.up
    )
    x, y, w, h = item.amodal_box
    last = np.array(shot.camera.size) - 1
    left, top, right, bottom = max(x, 0), max(y, 0), min(x + w - 1, last[0]), min(y + h - 1, last[1])
    inside = item.amodal_pixels * (1.0 - item.truncated_fraction)
    seen = item.visible_pixels / inside
    occluded = 0 if seen > CLEAR else 1 if seen > PARTLY else 2
    kind = (item.category or "object").replace(" ", "_")
    alpha = wrapped(turn - math.atan2(location[0], location[2]))
    numbers = [alpha, left, top, right, bottom, height, width, length, *location, turn]
    return (
        f"{kind} {item.truncated_fraction:.4f} {occluded} "
        + " ".join(f"{value:.6f}" for value in numbers)
        + "\n"
    )


def upright_box(
    camera: Camera, corners: Floats, rotation: Floats, up: str
) -> tuple[float, float, float, Floats, float]:
    """Returns an object's box, rotated only about the camera's y axis.

    The result is height, width, length, the centre of the bottom in camera axes, and the rotation about y in
    radians. The object's forward axis is x of its mesh (z if y is up). If the camera's y axis is not parallel
    to the object's up axis, the box is the smallest such box around the object's own box.
    """
    forward = product(camera.R, rotation[:, 0] if up == "z" else rotation[:, 2])
    turn = math.atan2(-forward[2], forward[0])
    cos, sin = math.cos(turn), math.sin(turn)
    camera_from_box = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    local = product(product(corners - camera.C, camera.R.T), camera_from_box)
    low, high = local.min(axis=0), local.max(axis=0)
    length, height, width = (float(value) for value in high - low)
    bottom = product(camera_from_box, [(low[0] + high[0]) / 2, high[1], (low[2] + high[2]) / 2])
    return height, width, length, bottom, turn


def wrapped(angle: float) -> float:
    """Returns the angle wrapped to [-pi, pi)."""
    return float((angle + math.pi) % (2 * math.pi) - math.pi)


def calibration(camera: Camera, other: Camera | None) -> str:
    """Returns an image's calibration file, in the axes of the left colour camera.

    The file describes no laser scanner. P2 = K [I | 0] is the left camera. P3 = K_right [I | -B] is the
    right camera, whose principal point may differ.
    """
    k = k_with_integer_centers(camera)
    left = np.column_stack([k, np.zeros(3)])
    right = left.copy()
    if other is not None:
        k = k_with_integer_centers(other)
        apart = float(product(camera.R, other.C - camera.C)[0])
        right = np.column_stack([k, [-k[0, 0] * apart, 0.0, 0.0]])
    identity = np.eye(3, 4)
    rows: dict[str, npt.NDArray[Any]] = {
        "P0": left,
        "P1": right,
        "P2": left,
        "P3": right,
        "R0_rect": np.eye(3),
    }
    rows |= {"Tr_velo_to_cam": identity, "Tr_imu_to_velo": identity}
    return "".join(f"{name}: {matrix_text(matrix)}\n" for name, matrix in rows.items())


def loss_of(kind: Literal["depth", "disparity"], what: str, values: Floats) -> Record:
    """Returns the record of the finite values that `fixed_point_u16` converts to 0."""
    seen = np.isfinite(values)
    return lost(kind, what, seen & (fixed_point_u16(values) == 0), seen)


def fixed_point_u16(values: Floats) -> npt.NDArray[np.uint16]:
    """Returns values times 256 as uint16; 0 (unknown) for values out of range."""
    with np.errstate(invalid="ignore"):
        scaled = np.rint(values * 256.0)
        return np.where((scaled >= 1) & (scaled <= 65535), scaled, 0).astype(np.uint16)


def disparities(shot: Shot, right: Camera, base: str, name: str) -> tuple[dict[str, bytes], Record]:
    """Returns disparity maps, and the record of lost values.

    One map contains all surfaces, the other map only the surfaces that are visible in both cameras.
    """
    found = disparity(shot.world, shot.camera, right, threads=shot.plan.threads)
    exact = found["disparity"].astype(np.float64)
    values = fixed_point_u16(exact)
    both = ~found["occluded"] & ~found["outside"]
    files = {
        f"{base}/disp_occ_0/{name}_10.png": png(values),
        f"{base}/disp_noc_0/{name}_10.png": png(np.where(both, values, 0)),
    }
    return files, loss_of("disparity", f"disparity of at most 0 or above {MAX_U16:.6g} pixels", exact)


def flows(shot: Shot, following: Shot, base: str, name: str) -> tuple[dict[str, bytes], Record]:
    """Returns maps of the flow to the next image, and the record of lost values.

    One map contains all surfaces, the other map only the surfaces that are visible in the next image.
    """
    found = flow(shot.world, shot.camera, following.world, following.camera, threads=shot.plan.threads)
    both = ~found["occluded"] & ~found["outside"]
    every = flow16(found["flow"], np.ones_like(both))
    files = {
        f"{base}/flow_occ/{name}_10.png": png(every),
        f"{base}/flow_noc/{name}_10.png": png(flow16(found["flow"], both)),
    }
    known = np.isfinite(found["flow"][..., 0])  # either both components are finite, or neither is
    return files, lost("flow", "flow of 512 pixels or more", known & (every[..., 2] == 0), known)


def flow16(moved: npt.NDArray[np.float32], wanted: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint16]:
    """Encodes flow: u and v in pixels times 64 plus 2^15, and 1 for valid.

    Pixels are valid if they are `wanted` and the flow is from -512 to less than 512 pixels.
    """
    with np.errstate(invalid="ignore"):
        scaled = np.rint(moved.astype(np.float64) * 64.0) + 32768.0
        valid = wanted & ((scaled >= 0) & (scaled <= 65535)).all(axis=2)
    image = np.zeros((*valid.shape, 3), dtype=np.uint16)
    image[valid, :2] = scaled[valid]
    image[..., 2] = valid
    return image


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates the file of poses of all views, camera to world, as in the odometry benchmark."""

    yield "poses.txt", ((record["pose"] + "\n").encode() for record in records())


FORMAT = Format(make, index, check, OPTIONS, units=units, many_worlds=True, posed=True)
