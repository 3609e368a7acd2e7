"""Writes `transforms.json`, the format of NeRF and nerfstudio.

Source: nerfstudio's documentation, "Data conventions".
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator

import numpy as np

from ..camera import Camera
from ..errors import CameraError
from .lost import KEY, check_depth_scale, depth_units
from .plan import Format, Index, Made, Plan, Record, k_with_half_centers, png

__all__ = ["FORMAT"]

DISTORTION = {"opencv": ("k1", "k2", "p1", "p2", "k3"), "fisheye": ("k1", "k2", "k3", "k4")}
"""Coefficients with the same meaning in nerfstudio; its k4 is a fourth-power term, OpenCV's k4 a denominator."""
MODELS = {
    "pinhole": "PINHOLE",
    "opencv": "OPENCV",
    "fisheye": "OPENCV_FISHEYE",
    "equirectangular": "EQUIRECTANGULAR",
}
"""nerfstudio's `camera_model` by lens model."""


def check(plan: Plan) -> None:
    """Raises `CameraError` for cameras that nerfstudio does not support.

    All cameras must also have the same lens model, because `transforms.json` contains only one lens model.
    """
    check_depth_scale(plan.options["depth_scale"])
    for number, view in enumerate(plan.shots):
        camera = view.camera
        if camera.model not in MODELS:
            raise CameraError(
                f"camera {number}: transforms.json does not support lens model {camera.model}; supported: "
                f"{', '.join(MODELS)}",
                code="unsupported_camera",
            )
        if camera.K[0, 1] != 0.0:
            raise CameraError(
                f"camera {number}: transforms.json does not support skew; K[0, 1] is {camera.K[0, 1]}",
                code="unsupported_camera",
            )
        if camera.model == "equirectangular":
            check_whole_panorama(camera, number)
        elif camera.distortion is not None and np.any(camera.distortion[len(DISTORTION[camera.model]) :]):
            names = ", ".join(DISTORTION[camera.model])
            raise CameraError(
                f"camera {number}: transforms.json supports only {names} of lens model {camera.model}; "
                f"distortion is {camera.distortion.tolist()}",
                code="unsupported_camera",
            )
    models = sorted({view.camera.model for view in plan.shots})
    if len(models) > 1:
        raise CameraError(
            f"the cameras have the lens models {', '.join(models)}, but transforms.json supports "
            "only one camera_model; write one data set per lens model",
            code="unsupported_camera",
        )


def check_whole_panorama(camera: Camera, number: int) -> None:
    """Raises `CameraError` unless a panorama shows all directions.

    The format cannot represent a partial panorama, because nerfstudio stores only a panorama's size.
    """
    width, height = camera.size
    if width != 2 * height:
        fault = f"the size is {width} x {height}"
    else:
        whole = Camera.equirectangular([0, 0, 0], size=camera.size, pixel_center=camera.pixel_center)
        if np.allclose(camera.K, whole.K, rtol=0, atol=1e-9 * width):
            return
        fault = (
            f"K is {camera.K.round(6).tolist()} instead of {whole.K.round(6).tolist()}, a partial panorama"
        )
    raise CameraError(
        f"camera {number}: {fault}; transforms.json supports only panoramas of all directions, twice as wide as "
        "high, so use Camera.equirectangular with size=(2 * height, height)",
        code="unsupported_camera",
    )


def make(plan: Plan, number: int) -> Made:
    """Renders the colour and the depth image, and creates a row of `transforms.json`.

    Depth is in steps of `depth_scale`. It is along the optical axis for pinhole cameras with or without lens
    coefficients, and the distance from the camera for fisheye lenses and panoramas: nerfstudio multiplies depth by the
    length of the ray's direction, which is 1 for these lenses. Source: nerfstudio, cameras/cameras.py
    (`directions_norm`), model_components/losses.py (`depth_loss`).
    """
    shot = plan.shot(number)
    channel = "distance" if shot.camera.model in ("fisheye", "equirectangular") else "depth"
    frame = shot.render(["color", channel])
    picture, distance = f"images/{plan.picture_name(number)}.png", f"depths/{plan.picture_name(number)}.png"
    depth, _, loss = depth_units(frame[channel], plan.options["depth_scale"])
    row = {
        "file_path": picture,
        "depth_file_path": distance,
        **intrinsics(shot.camera),
        "transform_matrix": opengl_pose(shot.camera),
        **loss,
    }
    return {picture: frame.to_png(), distance: png(depth)}, row


def opengl_pose(camera: Camera) -> list[list[float]]:
    """Returns the pose camera to world [4, 4], with camera axes x right, y up, z backward."""
    pose = np.eye(4)
    pose[:3, :3] = camera.R.T * [1, -1, -1]
    pose[:3, 3] = camera.C
    return [[float(value) for value in row] for row in pose]


def intrinsics(camera: Camera) -> Record:
    """Returns a camera's intrinsics; the centre of the first pixel is (0.5, 0.5).

    A panorama has nerfstudio's fl_x = w / 2 and fl_y = h. Source: nerfstudio, cameras/cameras.py, EQUIRECTANGULAR.
    """
    width, height = camera.size
    if camera.model == "equirectangular":
        middle = {"cx": width / 2, "cy": height / 2}
        return {"fl_x": width / 2, "fl_y": float(height), **middle, "w": width, "h": height}
    k = k_with_half_centers(camera)
    found = {"fl_x": k[0, 0], "fl_y": k[1, 1], "cx": k[0, 2], "cy": k[1, 2], "w": width, "h": height}
    if camera.distortion is not None:
        names = DISTORTION[camera.model]
        values = np.zeros(len(names))
        given = camera.distortion[: len(names)]
        values[: len(given)] = given
        found |= dict(zip(names, values.tolist(), strict=True))
    return found


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates `transforms.json`; values that all cameras share are at the top."""
    first = plan.shots[0].camera
    shared = all(intrinsics(view.camera) == intrinsics(first) for view in plan.shots)
    head: Record = {"camera_model": MODELS[first.model]}
    if plan.options["depth_scale"] != 1.0:
        head["depth_unit_scale_factor"] = plan.options["depth_scale"] / 1000.0
    if shared:
        head |= intrinsics(first)
        if first.model == "pinhole":
            width, height = first.size
            head["camera_angle_x"] = 2 * math.atan(width / (2 * float(first.K[0, 0])))
            head["camera_angle_y"] = 2 * math.atan(height / (2 * float(first.K[1, 1])))
    own = {"file_path", "depth_file_path", "transform_matrix"}

    def text() -> Iterator[bytes]:
        yield json.dumps(head, indent=2)[:-2].encode() + b',\n  "frames": ['
        for number, record in enumerate(records()):
            row = {key: value for key, value in record.items() if key != KEY and (not shared or key in own)}
            yield (b",\n    " if number else b"\n    ") + json.dumps(row).encode()
        yield b"\n  ]\n}\n"

    yield "transforms.json", text()


FORMAT = Format(make, index, check, {"depth_scale": 1.0}, posed=True)
