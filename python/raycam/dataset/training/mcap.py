"""Writes a ROS 2 bag in MCAP.

The bag contains camera_info, images, depth, instance ids, robots, poses and the frame tree. Requires `mcap`.

Sources: the MCAP specification (mcap.dev); ROS 2 `sensor_msgs`, `geometry_msgs` and `tf2_msgs`; REP-105 for
the frames; OMG CDR, little endian, aligned as in XCDR1.
"""

from __future__ import annotations

import base64
import importlib
import json
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from heapq import merge
from itertools import chain
from types import ModuleType
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from ...annotations.flow import check_rectified
from ...arguments import Floats, real
from ...camera import Camera
from ...errors import CameraError, SettingsError
from ...one_line import counted
from ..plan import Format, Index, Made, Plan, Record, View, k_with_integer_centers
from .cdr import BODY, WORLD, Cdr, body_of, mount_of, quaternion, transform
from .mcap_imu import IMU_DEFINITION, check_imu, imu_records
from .mcap_lidars import lidar_messages
from .mcap_robots import DESCRIPTION_TOPIC, JOINT_STATE, description_messages, robot_notices, robot_records

__all__ = ["FORMAT"]

OPTIONS = {"fps": 30.0, "topic": "/camera", "depth": True, "start_time": 1.0, "imu": 0.0}
HEADER = "std_msgs/Header header\n"
RULE = "=" * 80 + "\n"
STAMPED = (
    f"{RULE}MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    f"{RULE}MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
QUATERNION = f"{RULE}MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
DEFINITIONS = {
    "sensor_msgs/msg/CameraInfo": f"{HEADER}uint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n"
    "float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n"
    f"{RULE}MSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\n"
    f"bool do_rectify\n{STAMPED}",
    "sensor_msgs/msg/CompressedImage": f"{HEADER}string format\nuint8[] data\n{STAMPED}",
    "sensor_msgs/msg/Image": f"{HEADER}uint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n"
    f"uint8[] data\n{STAMPED}",
    "geometry_msgs/msg/PoseStamped": f"{HEADER}geometry_msgs/Pose pose\n{RULE}MSG: geometry_msgs/Pose\n"
    f"geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n{RULE}MSG: geometry_msgs/Point\nfloat64 x\n"
    f"float64 y\nfloat64 z\n{QUATERNION}{STAMPED}",
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms\n"
    f"{RULE}MSG: geometry_msgs/TransformStamped\n{HEADER}string child_frame_id\ngeometry_msgs/Transform transform\n"
    f"{RULE}MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"
    f"{RULE}MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n{QUATERNION}{STAMPED}",
    "sensor_msgs/msg/PointCloud2": f"{HEADER}uint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n"
    "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n"
    f"{RULE}MSG: sensor_msgs/PointField\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n{STAMPED}",
    "std_msgs/msg/String": "string data\n",
    JOINT_STATE: f"{HEADER}string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n{STAMPED}",
    **{
        kind: f"{text}{RULE}MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n{QUATERNION}{STAMPED}"
        for kind, text in IMU_DEFINITION.items()
    },
}
"""Message definitions in `ros2msg` syntax, including nested types."""
BAG = "raycam.mcap"
Message = tuple[str, str, bytes]
"""Topic, type and bytes of a message."""
LATCHED = ("/tf_static", "/instances")
"""Topics that are sent once and that late subscribers also receive, with the robots' descriptions."""
LATCHED_QOS = (
    "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n  deadline:\n    sec: 9223372036\n"
    "    nsec: 854775807\n  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n"
    "  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n  avoid_ros_namespace_conventions: false"
)
"""Quality of service of latched topics in rosbag2's syntax: reliable and transient local."""


def library() -> ModuleType:
    """Returns the module `mcap.writer`.

    Raises `SettingsError` with a remedy if mcap is not installed.
    """
    try:
        return importlib.import_module("mcap.writer")
    except ImportError:
        raise SettingsError(
            "the format mcap requires mcap; pip install 'raycam[mcap]'", code="missing_dependency"
        ) from None


def distortion(camera: Camera) -> tuple[str, list[float]]:
    """Returns ROS's name and coefficients of a camera's lens model.

    Raises `SettingsError` for lens models that ROS does not support.
    """
    values = [] if camera.distortion is None else camera.distortion.tolist()
    if camera.model == "pinhole":
        return "plumb_bob", [0.0] * 5
    if camera.model == "opencv" and len(values) in (4, 5):
        return "plumb_bob", [*values, 0.0][:5]
    if camera.model == "opencv" and not any(values[8:]):
        return "rational_polynomial", values[:8]
    if camera.model == "fisheye":
        return "equidistant", values
    raise SettingsError(
        f"ROS does not support lens model {camera.model!r} with {counted(len(values), 'coefficient')}; supported: "
        "opencv (4, 5 or 8), fisheye",
        code="unsupported_camera",
    )


def baseline(plan: Plan, number: int) -> float:
    """Returns the distance in metres to the left camera of the view's rectified pair.

    If several cameras of the rig form a rectified pair with the view's camera, the leftmost camera is used. Returns 0
    without such a camera.
    """
    view = plan.shots[number]
    if view.rig is None:
        return 0.0
    frame, found = (view.rig[0], view.world), 0.0
    for other in plan.shots:
        if other.has_camera and other.rig is not None and (other.rig[0], other.world) == frame:
            with suppress(CameraError):
                check_rectified(other.camera, view.camera)
                found = max(found, float(np.linalg.norm(view.camera.C - other.camera.C)))
    return found


def camera_info(camera: Camera, stamp: int, frame: str, right: float = 0.0) -> bytes:
    """Returns a `sensor_msgs/CameraInfo`; as in ROS, the centre of the first pixel is (0, 0).

    `right` is the `baseline` of a rectified pair: P[0, 3] is -fx times `right`.
    """
    model, values = distortion(camera)
    k = k_with_integer_centers(camera)
    width, height = camera.size
    message = Cdr().add_header(stamp, frame).add_numbers("I", height, width).add_text(model)
    message.add_numbers("I", len(values)).add_numbers("d", *values).add_numbers(
        "d", *k.ravel(), *np.eye(3).ravel()
    )
    message.add_numbers("d", *np.column_stack([k, [0.0 - k[0, 0] * right, 0.0, 0.0]]).ravel())
    return message.add_numbers("I", 0, 0).add_numbers("I", 0, 0, 0, 0).add_numbers("B", 0).to_bytes()


def names(plan: Plan, number: int) -> tuple[str, str]:
    """Returns the prefix of a view's topics, and the name of its coordinate frame."""
    view = plan.shots[number]
    own = view.rig[1] if view.rig is not None else view.name or ""
    topic = str(plan.options["topic"]).rstrip("/")
    return (f"{topic}/{own}" if own else topic), f"{own or 'camera'}_optical"


def check(plan: Plan) -> None:
    """Raises `SettingsError` if mcap is not installed, and for invalid options.

    Lens models that ROS does not support and times before 0 also raise `SettingsError`.
    """
    library()
    topic = plan.options["topic"]
    real("fps", plan.options["fps"], 0, above=True, what="a number of frames per second")
    if not (isinstance(topic, str) and topic.startswith("/")):
        raise SettingsError(
            f"topic is {topic!r}, expected a name that begins with /, such as /camera", code="invalid_value"
        )
    start = real("start_time", plan.options["start_time"], 0, 2**31 - 1, what="a time in seconds")
    check_imu(plan)
    for number, view in enumerate(plan.shots):
        if view.has_camera:
            distortion(view.camera)
        if view.time is not None and start + view.time < 0:
            raise SettingsError(
                f"view {number} is at {view.time} s; start_time + time must be at least 0: use start_time={-view.time}",
                code="out_of_range",
            )


def stamp_of(plan: Plan, number: int) -> int:
    """Returns a view's time stamp in nanoseconds, which is `start_time` plus the view's time.

    For a view without a time, the time is its frame number divided by `fps`. All cameras of a rig's pose have the same
    stamp. ROS interprets a stamp of 0 as "the latest", so `start_time` is 1 by default.
    """
    view = plan.shots[number]
    frame = number if view.rig is None else view.rig[0]
    seconds = view.time if view.time is not None else frame / float(plan.options["fps"])
    return round(float(plan.options["start_time"]) * 1e9) + round(seconds * 1e9)


def make(plan: Plan, number: int) -> Made:
    """Creates an image as PNG, and its record.

    The record contains the bag's messages about the image and about the lidars.
    """
    stamp, view = stamp_of(plan, number), plan.shots[number]
    files, messages = image_messages(plan, number, stamp) if view.has_camera else ({}, [])
    messages += transforms(plan, number, stamp)
    messages += lidar_messages(plan, number, stamp)
    rows = [(name, kind, base64.b64encode(data).decode()) for name, kind, data in messages]
    return files, {"stamp": stamp, "messages": rows}


def image_messages(plan: Plan, number: int, stamp: int) -> tuple[dict[str, bytes], list[Message]]:
    """Returns a view's image as a PNG file, and its messages: topic, type and bytes."""
    shot = plan.shot(number)
    camera, deep = shot.camera, bool(plan.options["depth"])
    frame = shot.render(["color", "instance", *(["depth"] if deep else [])])
    topic, optical = names(plan, number)
    picture = frame.to_png()
    pose = (
        Cdr().add_header(stamp, WORLD).add_numbers("d", *camera.C).add_numbers("d", *quaternion(camera.R.T))
    )
    image = Cdr().add_header(stamp, optical).add_text("png").add_bytes(picture)
    messages = [
        (
            f"{topic}/camera_info",
            "sensor_msgs/msg/CameraInfo",
            camera_info(camera, stamp, optical, baseline(plan, number)),
        ),
        (f"{topic}/image/compressed", "sensor_msgs/msg/CompressedImage", image.to_bytes()),
        (f"{topic}/pose", "geometry_msgs/msg/PoseStamped", pose.to_bytes()),
    ]
    ids = frame["instance"].astype("<i4")
    messages.append((f"{topic}/instance", "sensor_msgs/msg/Image", image_of(ids, "32SC1", stamp, optical)))
    if deep:
        metres = np.where(np.isfinite(frame["depth"]), frame["depth"], np.nan).astype("<f4")
        messages.append(
            (f"{topic}/depth", "sensor_msgs/msg/Image", image_of(metres, "32FC1", stamp, optical))
        )
    return {f"images/{plan.picture_name(number)}.png": picture}, messages


def image_of(values: npt.NDArray[Any], encoding: str, stamp: int, frame: str) -> bytes:
    """Returns a `sensor_msgs/Image` of four-byte values [height, width], little endian."""
    height, width = values.shape
    message = Cdr().add_header(stamp, frame).add_numbers("I", height, width).add_text(encoding)
    return message.add_numbers("B", 0).add_numbers("I", 4 * width).add_bytes(values.tobytes()).to_bytes()


def transforms(plan: Plan, number: int, stamp: int) -> list[Message]:
    """Returns the transforms that a view adds to the frame tree.

    The optical frame of a single camera is a child of `world`. The cameras of a rig are children of `base_link`,
    which moves in `world`. `base_link` is the rig's body, or the first camera if the rig's cameras move relative to
    each other.
    """
    kind, view = "tf2_msgs/msg/TFMessage", plan.shots[number]
    optical = names(plan, number)[1]
    if view.rig is None:
        moved = transform(stamp, WORLD, optical, view.camera.R.T, view.camera.C)
        return [("/tf", kind, moved)]
    pose = next(frame for frame in plan.rigs if number in frame)
    R, C = body_of(plan, pose)
    found = []
    if number == pose[0]:
        found.append(("/tf", kind, transform(stamp, WORLD, BODY, R.T, C)))
    if not view.has_camera:
        return found
    fixed = has_fixed_mounts(plan)
    if not fixed or pose is plan.rigs[0]:
        place = transform(stamp, BODY, optical, *mount_of(view.camera, R, C))
        found.append(("/tf_static" if fixed else "/tf", kind, place))
    return found


_fixed: WeakKeyDictionary[Plan, bool] = WeakKeyDictionary()


def has_fixed_mounts(plan: Plan) -> bool:
    """Returns True if the cameras have the same poses on the body at every pose of the rigs.

    The result is computed once per plan.
    """
    if plan not in _fixed:
        mounts: dict[str, tuple[Floats, Floats]] = {}

        def agrees(view: View, pose: list[int]) -> bool:
            name = "" if view.rig is None else view.rig[1]
            found = mount_of(view.camera, *body_of(plan, pose))
            known = mounts.setdefault(name, found)
            return all(np.allclose(a, b, rtol=0, atol=1e-9) for a, b in zip(found, known, strict=True))

        views = [(plan.shots[number], pose) for pose in plan.rigs for number in pose]
        _fixed[plan] = all(agrees(view, pose) for view, pose in views if view.has_camera)
    return _fixed[plan]


def is_latched(topic: str) -> bool:
    """Returns True for topics that are sent once and that late subscribers also receive."""
    return topic in LATCHED or topic.endswith(DESCRIPTION_TOPIC)


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates the bag in pieces, and `metadata.yaml`, which `ros2 bag` needs to open the folder."""
    table = {str(item.id): {"name": item.name, "category": item.category} for item in plan.objects}
    start = stamp_of(plan, 0)
    about = Cdr().add_text(json.dumps(table)).to_bytes()
    first = ("/instances", "std_msgs/msg/String", base64.b64encode(about).decode())
    frames = {names(plan, number)[1] for number, view in enumerate(plan.shots) if view.has_camera}

    def every() -> Iterator[Record]:
        robots = robot_records(plan, frames, stamp_of)
        moving = merge(records(), robots, imu_records(plan, stamp_of), key=lambda record: record["stamp"])
        return chain([{"stamp": start, "messages": [first, *description_messages(plan)]}], moving)

    yield BAG, bag(every())
    yield "metadata.yaml", [metadata(every()).encode()]


def bag(records: Iterator[Record]) -> Iterator[bytes]:
    """Iterates over the bytes of the bag, which is written to a temporary file."""
    with tempfile.TemporaryFile() as stream:
        writer = library().Writer(stream, compression=library().CompressionType.NONE)
        writer.start(profile="ros2", library="raycam")
        channels: dict[str, int] = {}
        schemas: dict[str, int] = {}
        for sequence, record in enumerate(records):
            for topic, kind, text in record["messages"]:
                if kind not in schemas:
                    schemas[kind] = writer.register_schema(kind, "ros2msg", DEFINITIONS[kind].encode())
                if topic not in channels:
                    about = {"offered_qos_profiles": LATCHED_QOS} if is_latched(topic) else {}
                    channels[topic] = writer.register_channel(topic, "cdr", schemas[kind], metadata=about)
                stamp = record["stamp"]
                data = base64.b64decode(text)
                writer.add_message(channels[topic], stamp, data, stamp, sequence)
        writer.finish()
        stream.seek(0)
        yield from iter(lambda: stream.read(1 << 20), b"")


def metadata(records: Iterator[Record]) -> str:
    """Returns the text of rosbag2's `metadata.yaml`, version 5."""
    counts: dict[tuple[str, str], int] = {}
    first, last = None, 0
    for record in records:
        first = record["stamp"] if first is None else min(first, record["stamp"])
        last = max(last, record["stamp"])
        for topic, kind, _ in record["messages"]:
            counts[topic, kind] = counts.get((topic, kind), 0) + 1
    quality = {topic: json.dumps(LATCHED_QOS if is_latched(topic) else "") for topic, _ in counts}
    topics = "".join(
        f"    - topic_metadata:\n        name: {json.dumps(topic)}\n        type: {kind}\n"
        f"        serialization_format: cdr\n"
        f"        offered_qos_profiles: {quality[topic]}\n      message_count: {count}\n"
        for (topic, kind), count in counts.items()
    )
    return (
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n"
        f"  duration:\n    nanoseconds: {last - (first or 0)}\n"
        f"  starting_time:\n    nanoseconds_since_epoch: {first or 0}\n"
        f"  message_count: {sum(counts.values())}\n  topics_with_message_count:\n{topics}"
        f"  compression_format: ''\n  compression_mode: ''\n  relative_file_paths:\n    - {BAG}\n"
    )


FORMAT = Format(make, index, check, OPTIONS, posed=True, writes_lidars=True, notices=robot_notices)
