"""Writing of joint states to MCAP bags of ROS 2; requires the package `mcap`.

Sources: ROS 2 `sensor_msgs/msg/JointState`; OMG CDR, little endian, plain (XCDR1); the MCAP specification (mcap.dev).
"""

from __future__ import annotations

import os
import struct
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, floats
from ..errors import SettingsError
from ..one_line import counted

__all__ = ["write_joint_states"]

TYPE = "sensor_msgs/msg/JointState"
SEPARATOR = "=" * 80
DEFINITION = (
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    f"{SEPARATOR}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    f"{SEPARATOR}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
MAX_SECONDS = 2**31
"""The first time in seconds that is too large for a ROS stamp."""


def write_joint_states(
    path: str | os.PathLike[str],
    joints: Mapping[str, npt.ArrayLike],
    times: npt.ArrayLike,
    *,
    topic: str = "/joint_states",
    start_time: float = 1.0,
) -> None:
    """Writes joint positions to an .mcap file, one `sensor_msgs/JointState` message per time.

    `joints` maps names to positions [n] in radians or metres; `times` [n] are increasing seconds. `topic` is the
    messages' topic. Stamps are `start_time` plus the time, because ROS interprets a stamp of 0 as the latest. `raycam
    video --trajectory` and ROS 2 read the file.

    Raises `SettingsError` without the package `mcap`, for other endings, for values that are not finite, times that do
    not increase and different numbers of values, and `OSError` if the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".mcap":
        raise SettingsError(f"{path}: expected a file name that ends in .mcap", code="unknown_format")
    try:
        from mcap.writer import Writer
    except ImportError:
        raise SettingsError(
            f"{path}: writing MCAP requires mcap; pip install 'raycam[mcap]'", code="missing_dependency"
        ) from None
    seconds = floats("times", times, ("n",), error=SettingsError)
    stamps = [round(1e9 * (float(start_time) + float(time))) for time in _checked("times", seconds)]
    if stamps and (stamps[0] < 0 or stamps[-1] >= MAX_SECONDS * 10**9):
        raise SettingsError(
            f"times from {seconds[0]:g} to {seconds[-1]:g} s plus start_time {start_time:g} s: expected stamps from 0"
            f" to {MAX_SECONDS - 1} s",
            code="out_of_range",
        )
    if any(after <= before for before, after in pairwise(stamps)):
        raise SettingsError("times must increase by at least 1 ns", code="unordered_times")
    columns = {}
    for name, values in joints.items():
        columns[name] = _checked(
            f"joint {name!r}", floats(f"joint {name!r}", values, ("n",), error=SettingsError)
        )
        if len(columns[name]) != len(stamps):
            raise SettingsError(
                f"joint {name!r}: got {counted(len(columns[name]), 'position')} for {counted(len(stamps), 'time')}; "
                "expected equal numbers",
                code="wrong_shape",
            )
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="raycam")
        schema = writer.register_schema(TYPE, "ros2msg", DEFINITION.encode())
        channel = writer.register_channel(topic, "cdr", schema)
        for number, stamp in enumerate(stamps):
            positions = [float(column[number]) for column in columns.values()]
            data = _encode(stamp, list(columns), positions)
            writer.add_message(channel, stamp, data, stamp, number)
        writer.finish()  # type: ignore[no-untyped-call]


def _checked(what: str, values: Floats) -> Floats:
    if not np.isfinite(values).all():
        count = int(np.count_nonzero(~np.isfinite(values)))
        raise SettingsError(
            f"{what} must be finite; {count} of {values.size} are NaN or infinite", code="out_of_range"
        )
    return values


def _encode(stamp: int, names: list[str], positions: list[float]) -> bytes:
    """A `JointState` without velocities and efforts, in CDR."""
    body = bytearray(struct.pack("<iI", *divmod(stamp, 10**9)))

    def align(size: int) -> None:
        body.extend(bytes(-len(body) % size))

    def add_text(text: str) -> None:
        align(4)
        raw = text.encode() + b"\0"
        body.extend(struct.pack("<I", len(raw)) + raw)

    add_text("")
    align(4)
    body.extend(struct.pack("<I", len(names)))
    for name in names:
        add_text(name)
    align(4)
    body.extend(struct.pack("<I", len(positions)))
    if positions:
        align(8)
        body.extend(struct.pack(f"<{len(positions)}d", *positions))
    body.extend(struct.pack("<II", 0, 0))
    return b"\0\1\0\0" + bytes(body)
