"""COLMAP's `rigs.txt` and `frames.txt`.

The files contain rigs, and the images that belong to each pose of a rig.

Source: COLMAP's documentation, "Rig Support" and "Output Format".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain

import numpy as np

from ..arguments import product
from ..camera import Camera
from ..errors import CameraError
from .plan import Index, Plan, matrix_text
from .rgbd import quaternion

__all__ = ["files"]


def check(plan: Plan) -> None:
    """Raises `CameraError` unless all poses belong to one rig with fixed mounts."""
    known: dict[str, tuple[Camera, Camera]] = {}
    for frame in plan.rigs:
        first = plan.shots[frame[0]].camera
        for number in frame:
            view = plan.shots[number]
            name = view.rig[1] if view.rig is not None else ""
            base, camera = known.setdefault(name, (first, view.camera))
            before, here = product(camera.R, base.R.T), product(view.camera.R, first.R.T)
            apart, now = product(base.R, camera.C - base.C), product(first.R, view.camera.C - first.C)
            if not (np.allclose(before, here, atol=1e-9) and np.allclose(apart, now, atol=1e-9)):
                raise CameraError(
                    f"camera {name!r} must have the same pose relative to its rig's first camera in all views; its "
                    f"rotation or position differs (relative positions: {apart} and {now} m)",
                    code="unsupported_camera",
                )


def files(plan: Plan, ids: Sequence[int]) -> Index:
    """Creates both files; `ids` are the camera ids of all views."""
    rigs = {tuple(ids[number] for number in frame): frame for frame in plan.rigs}
    single = dict.fromkeys(ids[number] for number, view in enumerate(plan.shots) if view.rig is None)
    numbers = {sensor: i + 1 for i, sensor in enumerate([*rigs, *((camera,) for camera in single)])}
    text = "# RIG_ID, NUM_SENSORS, REF_SENSOR_TYPE, REF_SENSOR_ID, SENSORS[] as (SENSOR_TYPE, SENSOR_ID, HAS_POSE, "
    text += "[QW, QX, QY, QZ, TX, TY, TZ])\n"
    for cameras, number in numbers.items():
        text += f"{number} {len(cameras)} CAMERA {cameras[0]}"
        frame = rigs.get(cameras, [])
        for camera, place in zip(cameras[1:], frame[1:], strict=True):
            first, view = plan.shots[frame[0]].camera, plan.shots[place].camera
            turn = product(view.R, first.R.T)
            shift = view.t - product(turn, first.t)
            text += f" CAMERA {camera} 1 {matrix_text(np.array([*quaternion(turn), *shift]))}"
        text += "\n"
    yield "sparse/0/rigs.txt", [text.encode()]
    yield "sparse/0/frames.txt", frames(plan, ids, numbers)


def frames(plan: Plan, ids: Sequence[int], numbers: Mapping[tuple[int, ...], int]) -> Iterator[bytes]:
    """Iterates over the lines of frames.txt; `numbers` maps tuples of camera ids to rig ids."""
    yield b"# FRAME_ID, RIG_ID, RIG_FROM_WORLD[QW, QX, QY, QZ, TX, TY, TZ], NUM_DATA_IDS, DATA_IDS[] as (SENSOR_TYPE, "
    yield b"SENSOR_ID, DATA_ID)\n"
    single = ([number] for number, view in enumerate(plan.shots) if view.rig is None)
    for i, group in enumerate(chain(plan.rigs, single)):
        first = plan.shots[group[0]].camera
        pose = matrix_text(np.array([*quaternion(first.R), *first.t]))
        pictures = " ".join(f"CAMERA {ids[number]} {number + 1}" for number in group)
        rig = numbers[tuple(ids[number] for number in group)]
        yield f"{i + 1} {rig} {pose} {len(group)} {pictures}\n".encode()
