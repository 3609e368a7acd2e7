"""Joint states of ROS 2 bags.

Supported are MCAP files (with the package `mcap`) and SQLite files of rosbag2.

Sources: ROS 2 `sensor_msgs/msg/JointState`; OMG CDR, plain (XCDR1); the MCAP specification (mcap.dev); the tables of
rosbag2_storage_sqlite3.
"""

from __future__ import annotations

import os
import sqlite3
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..arguments import Floats
from ..errors import FormatError, SettingsError, nearest

__all__ = ["BAG_SUFFIXES", "JointTrack", "is_bag", "read_joint_states"]

BAG_SUFFIXES = (".mcap", ".db3")
"""Endings of the files of a bag."""
JOINT_STATE = "sensor_msgs/msg/JointState"
DEFAULT_TOPIC = "/joint_states"
MAX_MESSAGE_BYTES = 1 << 20
MAX_RECORD_BYTES = 256 << 20
"""Largest record of an MCAP file, such as a chunk of messages."""
MAX_VALUES = 20_000_000
"""Largest number of positions in a bag."""


class JointTrack(NamedTuple):
    """The positions of a joint over time."""

    times: Floats
    """Increasing times [n] in seconds, 0 at the bag's first joint state."""
    positions: Floats
    """The positions of the joint [n], in radians or metres."""


class _State(NamedTuple):
    """The names and positions of one `JointState` message, with its time in nanoseconds."""

    time_ns: int
    names: list[str]
    positions: tuple[float, ...]


def read_joint_states(path: str | os.PathLike[str]) -> dict[str, JointTrack]:
    """Reads the joint states of a bag; returns the positions of each joint over time.

    `path` is an .mcap or .db3 file or the folder of a bag, optionally followed by `:/TOPIC`. The default topic is
    /joint_states, or the only topic with joint states. Times come from the headers, or from the recorder if the
    headers have none; of several positions at one time, the last is used. Messages may contain different joints.
    Messages without positions are skipped.

    Raises `OSError` if a file cannot be read, `FormatError` for damaged messages, compressed SQLite files and bags
    without joint states, and `SettingsError` for an unknown topic, for several topics without a choice, and for an MCAP
    file without the package `mcap`.
    """
    folder, topic = _split(os.fspath(path))
    found: dict[str, list[_State]] = {}
    count = 0
    for file in _files(folder):
        for name, data, logged in _messages(file):
            state = _decode(data, logged, f"{file}: topic {name}")
            count += len(state.positions)
            if count > MAX_VALUES:
                raise FormatError(
                    f"{file}: too many joint positions; the limit is {MAX_VALUES}; split the bag",
                    code="budget_exceeded",
                )
            found.setdefault(name, []).append(state)
    if not found:
        raise FormatError(f"{folder}: the bag contains no {JOINT_STATE} messages", code="missing_value")
    return _tracks(found[_chosen(folder, topic, list(found))])


def is_bag(path: str | os.PathLike[str]) -> bool:
    """Returns True for the path of a bag's folder or file, with or without a topic."""
    bare = _split(os.fspath(path))[0]
    return bare.suffix.lower() in BAG_SUFFIXES or bare.is_dir()


def _split(path: str) -> tuple[Path, str | None]:
    """The bag's path, and the topic after a colon."""
    head, colon, topic = path.rpartition(":/")
    return (Path(head), f"/{topic}") if colon and not Path(path).exists() else (Path(path), None)


def _chosen(folder: Path, topic: str | None, topics: list[str]) -> str:
    if topic is not None and topic not in topics:
        raise SettingsError(f"{folder}: {nearest('topic', topic, topics)}", code="unknown_name")
    wanted = topic or (topics[0] if len(topics) == 1 else DEFAULT_TOPIC)
    if wanted not in topics:
        listed = ", ".join(sorted(topics))
        raise SettingsError(
            f"{folder}: several topics have joint states: {listed}; append a topic, as in {folder}:{sorted(topics)[0]}",
            code="missing_value",
        )
    return wanted


def _files(path: Path) -> list[Path]:
    """The files of a bag."""
    if not path.is_dir():
        return [path]
    files = sorted(file for file in path.iterdir() if file.suffix.lower() in BAG_SUFFIXES and file.is_file())
    if not files:
        raise FormatError(
            f"{path}: the folder contains no files {' or '.join(BAG_SUFFIXES)}; compressed bags must be decompressed"
            " first: ros2 bag convert",
            code="file_not_found",
        )
    return files


def _messages(path: Path) -> Iterator[tuple[str, bytes, int]]:
    """Topic, bytes and recorder's time of each joint state of a file."""
    with path.open("rb") as stream:
        if not path.is_file():
            raise FormatError(
                f"{path}: a device, pipe or socket, expected a regular file", code="unknown_format"
            )
        start = stream.read(16)
    if start.startswith(b"\x89MCAP0\r\n"):
        return _mcap_messages(path)
    if start.startswith(b"SQLite format 3\0"):
        return _sqlite_messages(path)
    raise FormatError(f"{path}: expected an MCAP or SQLite file of a ROS 2 bag", code="unknown_format")


def _mcap_messages(path: Path) -> Iterator[tuple[str, bytes, int]]:
    try:
        from mcap.exceptions import McapError
        from mcap.reader import SeekingReader
    except ImportError:
        raise SettingsError(
            f"{path}: reading MCAP requires mcap; pip install 'raycam[mcap]'", code="missing_dependency"
        ) from None
    with path.open("rb") as stream:
        try:
            reader = SeekingReader(stream, record_size_limit=MAX_RECORD_BYTES)
            topics = _mcap_topics(path, reader.get_summary())
            for schema, channel, message in reader.iter_messages(topics, log_time_order=False):
                if schema is not None and schema.name == JOINT_STATE:
                    _check_encoding(path, channel.topic, channel.message_encoding)
                    yield channel.topic, message.data, message.log_time
        except (McapError, struct.error, ValueError, EOFError, KeyError) as error:
            raise FormatError(
                f"{path}: damaged MCAP file: {type(error).__name__}: {error}", code="damaged_data"
            ) from None


def _mcap_topics(path: Path, summary: Any) -> list[str] | None:
    """Returns the topics with joint states; None if the file has no summary.

    With these topics, chunks without joint states are skipped.
    """
    if summary is None:
        return None
    for chunk in summary.chunk_indexes:
        if chunk.uncompressed_size > MAX_RECORD_BYTES:
            raise FormatError(
                f"{path}: a chunk has {chunk.uncompressed_size} bytes; the limit is {MAX_RECORD_BYTES}",
                code="budget_exceeded",
            )
    kinds = {number for number, schema in summary.schemas.items() if schema.name == JOINT_STATE}
    return [channel.topic for channel in summary.channels.values() if channel.schema_id in kinds]


def _sqlite_messages(path: Path) -> Iterator[tuple[str, bytes, int]]:
    address = f"{path.absolute().as_uri()}?mode=ro&immutable=1"
    # Data beyond the limit is not read; the error is raised because of the data's length.
    query = (
        "select topics.name, topics.serialization_format, length(messages.data),"
        " iif(length(messages.data) <= ?, messages.data, null), messages.timestamp"
        " from messages join topics on topics.id = messages.topic_id where topics.type = ? order by messages.id"
    )
    try:
        connection = sqlite3.connect(address, uri=True)
        try:
            rows = connection.execute(query, (MAX_MESSAGE_BYTES, JOINT_STATE))
            for topic, encoding, size, data, time in rows:
                _check_encoding(path, topic, encoding)
                _check_size(f"{path}: topic {topic}", size)
                if not isinstance(topic, str) or not isinstance(data, bytes) or not isinstance(time, int):
                    raise FormatError(
                        f"{path}: the message table has wrong types; expected topic names (text), data (blobs) "
                        "and times (integers)",
                        code="damaged_data",
                    )
                yield topic, data, time
        finally:
            connection.close()
    except sqlite3.Error as error:
        raise FormatError(f"{path}: not a readable bag: {error}", code="damaged_data") from None


def _check_encoding(path: Path, topic: object, encoding: object) -> None:
    """Raises `FormatError` unless messages are encoded in CDR."""
    if encoding != "cdr":
        raise FormatError(
            f"{path}: topic {topic}: joint states are encoded as {encoding!r}, expected 'cdr'",
            code="wrong_format",
        )


def _check_size(where: str, size: object) -> None:
    """Raises `FormatError` for a message beyond the limit."""
    if isinstance(size, int) and size > MAX_MESSAGE_BYTES:
        raise FormatError(
            f"{where}: a message has {size} bytes; the limit is {MAX_MESSAGE_BYTES}", code="budget_exceeded"
        )


class _Reader:
    """Reads values of a message in CDR."""

    def __init__(self, data: bytes, where: str) -> None:
        if len(data) < 4 or data[0] != 0 or data[1] not in (0, 1):
            raise FormatError(
                f"{where}: expected a message in plain CDR, got the header {data[:4].hex()}",
                code="wrong_format",
            )
        self._data, self._place, self._where = data, 4, where
        self._order = "<" if data[1] == 1 else ">"

    def numbers(self, kind: str, count: int) -> tuple[float, ...]:
        """Reads numbers of a `struct` format, which are aligned to their size after the header."""
        size = struct.calcsize(kind)
        self._place += -(self._place - 4) % size if count else 0
        end = self._place + size * count
        if end > len(self._data):
            raise FormatError(
                f"{self._where}: a message ends after {len(self._data)} of {end} bytes", code="truncated_file"
            )
        found = struct.unpack_from(f"{self._order}{count}{kind}", self._data, self._place)
        self._place = end
        return found

    def count(self) -> int:
        """Reads the length of a sequence."""
        return int(self.numbers("I", 1)[0])

    def text(self) -> str:
        """Reads a string."""
        raw = b"".join(self.numbers("c", self.count()))  # type: ignore[arg-type]
        return raw.rstrip(b"\0").decode("utf-8", "replace")


def _decode(data: bytes, logged: int, where: str) -> _State:
    """Reads a `JointState`; without a time in the header, the recorder's time is used."""
    _check_size(where, len(data))
    reader = _Reader(data, where)
    seconds, nanoseconds = int(reader.numbers("i", 1)[0]), reader.count()
    reader.text()
    names = [reader.text() for _ in range(reader.count())]
    positions = reader.numbers("d", reader.count())
    if positions and len(positions) != len(names):
        raise FormatError(
            f"{where}: a message has {len(names)} names, but {len(positions)} positions; expected equal numbers",
            code="damaged_data",
        )
    if not np.isfinite(positions).all():
        raise FormatError(f"{where}: positions must be finite, got {list(positions)}", code="out_of_range")
    return _State(seconds * 10**9 + nanoseconds or logged, names, positions)


def _tracks(states: list[_State]) -> dict[str, JointTrack]:
    """The positions by joint; times are sorted and begin with 0."""
    states = sorted((state for state in states if state.positions), key=lambda state: state.time_ns)
    values: dict[str, dict[int, float]] = {}
    for state in states:
        for name, position in zip(state.names, state.positions, strict=True):
            values.setdefault(name, {})[state.time_ns] = position
    first = states[0].time_ns if states else 0
    return {
        name: JointTrack(np.array([1e-9 * (time - first) for time in track]), np.array(list(track.values())))
        for name, track in values.items()
    }
