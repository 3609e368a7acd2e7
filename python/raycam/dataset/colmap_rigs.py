"""COLMAP's `rigs.txt` and `frames.txt`: which pictures the cameras of a rig took together.

Source: COLMAP's documentation, "Rig Support" and "Output Format".
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..camera import Camera
from ..errors import CameraError
from .plan import Plan, matrix_text
from .rgbd import quaternion

__all__ = ["files"]


def check(plan: Plan) -> None:
    """All poses are of one rig: its cameras stand at the same places of it."""
    known: dict[str, tuple[Camera, Camera]] = {}
    for frame in plan.rigs:
        first = plan.shots[frame[0]].camera
        for number in frame:
            view = plan.shots[number]
            name = view.rig[1] if view.rig is not None else ""
            base, camera = known.setdefault(name, (first, view.camera))
            before, here = camera.R @ base.R.T, view.camera.R @ first.R.T
            apart, now = base.R @ (camera.C - base.C), first.R @ (view.camera.C - first.C)
            if not (np.allclose(before, here, atol=1e-9) and np.allclose(apart, now, atol=1e-9)):
                raise CameraError(
                    f"camera {name!r} stands at {now} of its rig, and at another pose at {apart}: expected one rig"
                )


def files(plan: Plan, ids: Sequence[int]) -> Iterator[tuple[str, list[bytes]]]:
    """Both files; `ids` are those of the cameras of all views."""
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
            turn = view.R @ first.R.T
            text += (
                f" CAMERA {camera} 1 {matrix_text(np.array([*quaternion(turn), *(view.t - turn @ first.t)]))}"
            )
        text += "\n"
    yield "sparse/0/rigs.txt", [text.encode()]
    groups = [*plan.rigs, *([n] for n, view in enumerate(plan.shots) if view.rig is None)]
    rows = [
        b"# FRAME_ID, RIG_ID, RIG_FROM_WORLD[QW, QX, QY, QZ, TX, TY, TZ], NUM_DATA_IDS, DATA_IDS[] as (SENSOR_TYPE, "
        b"SENSOR_ID, DATA_ID)\n"
    ]
    for i, group in enumerate(groups):
        first = plan.shots[group[0]].camera
        pose = matrix_text(np.array([*quaternion(first.R), *first.t]))
        images = " ".join(f"CAMERA {ids[n]} {n + 1}" for n in group)
        rig = numbers[tuple(ids[n] for n in group)]
        rows.append(f"{i + 1} {rig} {pose} {len(group)} {images}\n".encode())
    yield "sparse/0/frames.txt", rows
