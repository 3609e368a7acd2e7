"""MCAP as ROS 2 has it: one bag of all views, with camera_info, pictures, depth and poses. Needs the package `mcap`.

Source: mcap.dev, the specification; ROS 2 `sensor_msgs`, `geometry_msgs`; OMG CDR, little endian, as XCDR1 aligns it.
"""

from __future__ import annotations

import base64
import importlib
import json
import struct
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from types import ModuleType
from typing import Any

import numpy as np

from ...annotations.flow import check_rectified
from ...arguments import Floats
from ...camera import Camera
from ...errors import CameraError, SettingsError
from ..plan import Format, Index, Made, Plan, Record, k_with_integer_centers

__all__ = ["FORMAT"]

OPTIONS = {"fps": 30.0, "topic": "/camera", "depth": True}
HEADER = "std_msgs/Header header\n"
RULE = "=" * 80 + "\n"
STAMPED = (
    f"{RULE}MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    f"{RULE}MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
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
    f"float64 y\nfloat64 z\n{RULE}MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n{STAMPED}",
}
"""The messages in the words of `ros2msg`, with what they are made of."""
BAG = "raycam.mcap"


def library() -> ModuleType:
    """The module `mcap.writer`; raises `SettingsError` with the way on where it is not installed."""
    try:
        return importlib.import_module("mcap.writer")
    except ImportError:
        raise SettingsError("mcap needs the package mcap: pip install 'raycam[mcap]'") from None


class Cdr:
    """The bytes of a message in CDR, little endian."""

    def __init__(self) -> None:
        self._body = bytearray()

    def add_numbers(self, kind: str, *values: Any) -> Cdr:
        """Appends numbers of a kind of `struct`, each aligned to its size."""
        size = struct.calcsize(kind)
        self._body += bytes(-len(self._body) % size)
        self._body += struct.pack(f"<{len(values)}{kind}", *values)
        return self

    def add_text(self, value: str) -> Cdr:
        """Appends a string."""
        data = value.encode() + b"\0"
        self.add_numbers("I", len(data))._body += data
        return self

    def add_bytes(self, value: bytes) -> Cdr:
        """Appends a sequence of bytes."""
        self.add_numbers("I", len(value))._body += value
        return self

    def add_header(self, stamp: int, frame: str) -> Cdr:
        """Appends a `std_msgs/Header` of a time in nanoseconds."""
        return self.add_numbers("i", stamp // 10**9).add_numbers("I", stamp % 10**9).add_text(frame)

    def to_bytes(self) -> bytes:
        """The whole message."""
        return b"\0\1\0\0" + bytes(self._body)


def distortion(camera: Camera) -> tuple[str, list[float]]:
    """ROS's name and coefficients of a lens; raises `SettingsError` for those that ROS does not have."""
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
        f"ROS has no lens {camera.model!r} with {len(values)} coefficients: give opencv with 4, 5 or 8, or fisheye"
    )


def baseline(plan: Plan, number: int) -> float:
    """Metres from the leftmost camera of a view's rig with which it is a rectified pair; 0 for that one, and alone."""
    view = plan.shots[number]
    if view.rig is None:
        return 0.0
    frame, found = (view.rig[0], view.world), 0.0
    for other in plan.shots:
        if other.rig is not None and (other.rig[0], other.world) == frame:
            with suppress(CameraError):
                check_rectified(other.camera, view.camera)
                found = max(found, float(np.linalg.norm(view.camera.C - other.camera.C)))
    return found


def camera_info(camera: Camera, stamp: int, frame: str, right: float = 0.0) -> bytes:
    """A `sensor_msgs/CameraInfo`; K counts pixels from the centre of the first, as ROS does.

    `right` is the `baseline` of a rectified pair: P[0, 3] is -fx times that.
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


def quaternion(rotation: Floats) -> list[float]:
    """x, y, z, w of a rotation, w >= 0. Source: S. Shepperd, Quaternion from Rotation Matrix, 1978."""
    r, trace = rotation, np.trace(rotation)
    squares = np.array([2 * r[0, 0] - trace, 2 * r[1, 1] - trace, 2 * r[2, 2] - trace, trace])
    largest = int(np.argmax(squares))
    pairs = [[r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]]]
    pairs += [[r[0, 1] + r[1, 0], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]]]
    pairs += [[r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[1, 0] - r[0, 1]]]
    pairs += [[r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]]
    q = np.insert(np.array(pairs[largest]), largest, 1 + squares[largest])
    q /= np.sqrt((q * q).sum())
    return [float(value) for value in (q if q[3] >= 0 else -q)]


def names(plan: Plan, number: int) -> tuple[str, str]:
    """The topics' beginning and the frame of a view."""
    view = plan.shots[number]
    own = view.rig[1] if view.rig is not None else view.name or ""
    topic = str(plan.options["topic"]).rstrip("/")
    return (f"{topic}/{own}" if own else topic), f"{own or 'camera'}_optical"


def check(plan: Plan) -> None:
    """Raises `SettingsError` without mcap, for invalid options, lenses that ROS does not have and negative times."""
    library()
    fps, topic = plan.options["fps"], plan.options["topic"]
    if isinstance(fps, bool) or not (isinstance(fps, int | float) and fps > 0):
        raise SettingsError(f"fps is {fps!r}, expected frames per second, more than 0")
    if not (isinstance(topic, str) and topic.startswith("/")):
        raise SettingsError(f"topic is {topic!r}, expected a name that begins with /, as /camera")
    for number, view in enumerate(plan.shots):
        distortion(view.camera)
        if view.time is not None and view.time < 0:
            raise SettingsError(f"view {number} is at {view.time} s: times of a bag are not negative")


def stamp_of(plan: Plan, number: int) -> int:
    """The time of a view in nanoseconds: its own, or that of its frame at `fps`; a pose of a rig has one."""
    view = plan.shots[number]
    frame = number if view.rig is None else view.rig[0]
    seconds = view.time if view.time is not None else frame / float(plan.options["fps"])
    return round(seconds * 1e9)


def make(plan: Plan, number: int) -> Made:
    """Makes a picture as PNG; its messages are in the record, for the bag."""
    shot = plan.shot(number)
    camera, deep = shot.camera, bool(plan.options["depth"])
    frame = shot.render(["color", "depth"] if deep else ["color"])
    topic, optical = names(plan, number)
    stamp, picture = stamp_of(plan, number), frame.to_png()
    width, height = camera.size
    pose = (
        Cdr().add_header(stamp, "world").add_numbers("d", *camera.C).add_numbers("d", *quaternion(camera.R.T))
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
    if deep:
        metres = np.where(np.isfinite(frame["depth"]), frame["depth"], np.nan).astype("<f4")
        depth = (
            Cdr()
            .add_header(stamp, optical)
            .add_numbers("I", height, width)
            .add_text("32FC1")
            .add_numbers("B", 0)
            .add_numbers("I", 4 * width)
        )
        messages.append(
            (f"{topic}/depth", "sensor_msgs/msg/Image", depth.add_bytes(metres.tobytes()).to_bytes())
        )
    rows = [(name, kind, base64.b64encode(data).decode()) for name, kind, data in messages]
    return {f"images/{plan.picture_name(number)}.png": picture}, {"stamp": stamp, "messages": rows}


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Makes the bag, a piece for each view, and `metadata.yaml`, by which `ros2 bag` opens the folder."""
    yield BAG, bag(records())
    yield "metadata.yaml", [metadata(records()).encode()]


def bag(records: Iterator[Record]) -> Iterator[bytes]:
    """Iterates over the bytes of the bag, which is made in a temporary file."""
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
                    channels[topic] = writer.register_channel(topic, "cdr", schemas[kind])
                stamp = record["stamp"]
                data = base64.b64decode(text)
                writer.add_message(channels[topic], stamp, data, stamp, sequence)
        writer.finish()
        stream.seek(0)
        yield from iter(lambda: stream.read(1 << 20), b"")


def metadata(records: Iterator[Record]) -> str:
    """The text of rosbag2's `metadata.yaml`, version 5."""
    counts: dict[tuple[str, str], int] = {}
    first, last = None, 0
    for record in records:
        first = record["stamp"] if first is None else min(first, record["stamp"])
        last = max(last, record["stamp"])
        for topic, kind, _ in record["messages"]:
            counts[topic, kind] = counts.get((topic, kind), 0) + 1
    topics = "".join(
        f"    - topic_metadata:\n        name: {json.dumps(topic)}\n        type: {kind}\n"
        f"        serialization_format: cdr\n        offered_qos_profiles: ''\n      message_count: {count}\n"
        for (topic, kind), count in counts.items()
    )
    return (
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n"
        f"  duration:\n    nanoseconds: {last - (first or 0)}\n"
        f"  starting_time:\n    nanoseconds_since_epoch: {first or 0}\n"
        f"  message_count: {sum(counts.values())}\n  topics_with_message_count:\n{topics}"
        f"  compression_format: ''\n  compression_mode: ''\n  relative_file_paths:\n    - {BAG}\n"
    )


FORMAT = Format(make, index, check, OPTIONS, posed=True)
