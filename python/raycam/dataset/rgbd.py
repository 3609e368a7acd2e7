"""RGB-D sequences in the formats of TUM and ScanNet.

Sources: "File Formats" of the TUM RGB-D benchmark; the export of ScanNet's SensReader.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..arguments import Floats, lengths, real
from ..errors import CameraError, SettingsError
from .lost import check_depth_scale, depth_units
from .plan import NO_LENSES, Format, Index, Made, Plan, Record, k_with_integer_centers, matrix_text, png

__all__ = ["SCANNET", "TUM"]


def check(plan: Plan) -> None:
    """Raises an error unless all views have the same pinhole camera."""
    first = plan.shots[0].camera
    for number, view in enumerate(plan.shots):
        camera = view.camera
        if camera.model != "pinhole" or camera.K[0, 1] != 0.0:
            raise CameraError(
                f"camera {number} has a lens model or skew, which RGB-D sequences do not support; {NO_LENSES}",
                code="unsupported_camera",
            )
        if camera.size != first.size or not np.array_equal(camera.K, first.K):
            raise CameraError(
                f"camera {number} differs from camera 0 in K or size; an RGB-D sequence requires equal K and size",
                code="unsupported_camera",
            )
    check_depth_scale(plan.options["depth_scale"])
    real("fps", plan.options["fps"], 0, above=True, what="a number of frames per second")


def check_tum(plan: Plan) -> None:
    """Raises an error if two images would have the same name, which is a time with six decimals."""
    check(plan)
    views: dict[str, int] = {}
    for number in range(len(plan.shots)):
        time = timestamp(plan, number)
        if time in views:
            raise SettingsError(
                f"views {views[time]} and {number} have the same time {time}, but the time is the image's name; an "
                "RGB-D sequence requires distinct times",
                code="duplicate_name",
            )
        views[time] = number


def timestamp(plan: Plan, number: int) -> str:
    """Returns the timestamp in seconds: the view's time, or its number divided by `fps`."""
    time = plan.shots[number].time
    return f"{number / plan.options['fps'] if time is None else time:.6f}"


def make_tum(plan: Plan, number: int) -> Made:
    """Renders the colour and depth image (in steps of `depth_scale`), named by the timestamp."""
    frame = plan.shot(number).render(["color", "depth"])
    depth, _, loss = depth_units(frame["depth"], plan.options["depth_scale"])
    name = f"{timestamp(plan, number)}.png"
    return {f"rgb/{name}": frame.to_png(), f"depth/{name}": png(depth)}, loss


def index_tum(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates the lists of images, the trajectory (camera to world), and the camera."""
    times = [timestamp(plan, number) for number in range(len(plan.shots))]
    for kind in ("rgb", "depth"):
        yield (
            f"{kind}.txt",
            [f"# timestamp filename\n{''.join(f'{t} {kind}/{t}.png' + chr(10) for t in times)}".encode()],
        )
    yield "associations.txt", ["".join(f"{t} rgb/{t}.png {t} depth/{t}.png\n" for t in times).encode()]

    def trajectory() -> Iterator[bytes]:
        yield b"# timestamp tx ty tz qx qy qz qw\n"
        for time, view in zip(times, plan.shots, strict=True):
            w, x, y, z = quaternion(view.camera.R.T)
            yield f"{time} {matrix_text(np.array([*view.camera.C, x, y, z, w]))}\n".encode()

    yield "groundtruth.txt", trajectory()
    k = k_with_integer_centers(plan.shots[0].camera)
    units = f"# fx fy cx cy, depth is in 1/{1000 / plan.options['depth_scale']:.9g} m\n"
    yield "calibration.txt", [f"{units}{k[0, 0]} {k[1, 1]} {k[0, 2]} {k[1, 2]}\n".encode()]


def make_scannet(plan: Plan, number: int) -> Made:
    """Creates the files of an image: colour, depth, pose, instances and labels.

    Depth is in steps of `depth_scale`; the pose is camera to world.
    """
    shot = plan.shot(number)
    frame = shot.render(["color", "depth", "instance", "category"])
    depth, _, loss = depth_units(frame["depth"], plan.options["depth_scale"])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = shot.camera.R.T, shot.camera.C
    made = {
        f"color/{number}.png": frame.to_png(),
        f"depth/{number}.png": png(depth),
        f"pose/{number}.txt": four_by_four(pose).encode(),
    }
    # The value 0 means that a pixel shows no object, as in ScanNet.
    for kind, ids in (
        ("instance", frame["instance"] + 1),
        ("label", np.maximum(shot.channel(frame, "category"), 0)),
    ):
        if ids.max() > 65535:
            raise SettingsError(
                f"{kind} value {ids.max()} does not fit into a 16-bit PNG; the largest value is 65535",
                code="out_of_range",
            )
        made[f"{kind}/{number}.png"] = png(ids.astype(np.uint16))
    return made, loss


def index_scannet(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates the camera files, which colour and depth share."""
    k = np.eye(4)
    k[:3, :3] = k_with_integer_centers(plan.shots[0].camera)
    for kind in ("color", "depth"):
        yield f"intrinsic/intrinsic_{kind}.txt", [four_by_four(k).encode()]
        yield f"intrinsic/extrinsic_{kind}.txt", [four_by_four(np.eye(4)).encode()]


def four_by_four(matrix: Floats) -> str:
    """Returns the text of a 4 x 4 matrix, one row per line."""
    return "".join(matrix_text(row) + "\n" for row in matrix)


def quaternion(rotation: Floats) -> Floats:
    """Returns the quaternion (w, x, y, z) of a rotation, w >= 0.

    Source: Shepperd, Quaternion from rotation matrix, 1978.
    """
    r = rotation
    squares = np.array([r[0, 0] + r[1, 1] + r[2, 2], r[0, 0], r[1, 1], r[2, 2]])
    largest = int(squares.argmax())
    if largest == 0:
        q = np.array([1 + squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    else:
        i, j, k = np.roll([0, 1, 2], 1 - largest)
        q = np.zeros(4)
        q[0] = r[k, j] - r[j, k]
        q[1 + i], q[1 + j], q[1 + k] = 1 + 2 * r[i, i] - squares[0], r[j, i] + r[i, j], r[k, i] + r[i, k]
    q /= lengths(q)
    return q if q[0] >= 0 else -q


TUM = Format(make_tum, index_tum, check_tum, {"fps": 30.0, "depth_scale": 0.2}, posed=True)
SCANNET = Format(make_scannet, index_scannet, check, {"fps": 30.0, "depth_scale": 1.0}, posed=True)
