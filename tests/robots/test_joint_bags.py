"""Joint states of bags that rosbags has written."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.robots import read_joint_states
from raycam.world.joint_keyframes import read_trajectory
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from support.raises import fault, raises, warns

STORE = get_typestore(Stores.ROS2_HUMBLE)
KIND = "sensor_msgs/msg/JointState"
Message = tuple[float, Sequence[str], Sequence[float]]
PLUGINS = {"mcap": StoragePlugin.MCAP, "db3": StoragePlugin.SQLITE3}


def state(time: float, names: Sequence[str], positions: Sequence[float], frame: str = "") -> bytes:
    types = STORE.types
    stamp = types["builtin_interfaces/msg/Time"](int(time), round(time % 1 * 1e9))
    empty = np.zeros(0)
    message = types[KIND](
        types["std_msgs/msg/Header"](stamp, frame), list(names), np.array(positions, float), empty, empty
    )
    return bytes(STORE.serialize_cdr(message, KIND))


def write_bag(
    path: Path, topics: dict[str, list[Message]], plugin: str = "mcap", frame: str = "base"
) -> Path:
    """A bag with joint states and a topic of strings.

    Messages are recorded 5 ms after their stamps.
    """
    with Writer(path, version=9, storage_plugin=PLUGINS[plugin]) as writer:
        text = writer.add_connection("/robot_description", "std_msgs/msg/String", typestore=STORE)
        string = STORE.types["std_msgs/msg/String"]("<robot/>")
        writer.write(text, 1, bytes(STORE.serialize_cdr(string, "std_msgs/msg/String")))
        for topic, messages in topics.items():
            connection = writer.add_connection(topic, KIND, typestore=STORE)
            for time, names, positions in messages:
                logged = round(time * 1e9) + 5_000_000
                writer.write(connection, logged, state(time, names, positions, frame))
    return path


@pytest.mark.parametrize("plugin", PLUGINS)
@pytest.mark.parametrize("frame", ["", "base", "a name of an odd length"])
def test_positions_and_times_equal_the_messages(tmp_path: Path, plugin: str, frame: str) -> None:
    rng = np.random.default_rng(3)
    positions = rng.normal(size=(20, 3))
    names = ["a", "joint_of_seven", "ü"]
    messages = [(1_700_000_000 + 0.25 * i, names, row) for i, row in enumerate(positions)]
    path = write_bag(tmp_path / "bag", {"/joint_states": messages}, plugin, frame)
    files = sorted(path.glob(f"*.{plugin}"))
    assert len(files) == 1
    for one in (path, files[0]):
        found = read_joint_states(one)
        assert list(found) == names
        for column, name in enumerate(names):
            np.testing.assert_array_equal(found[name].positions, positions[:, column])
            np.testing.assert_allclose(found[name].times, 0.25 * np.arange(20), rtol=0, atol=1e-9)


def test_messages_may_contain_different_joints_and_be_out_of_order(tmp_path: Path) -> None:
    messages: list[Message] = [
        (12.0, ["a"], [3]),
        (10.0, ["a", "b"], [1, -1]),
        (11.0, ["b"], [-2]),
        (11.5, ["a"], []),
        (12.0, ["a"], [4]),
    ]
    found = read_joint_states(write_bag(tmp_path / "bag", {"/joint_states": messages}))
    assert {name: (track.times.tolist(), track.positions.tolist()) for name, track in found.items()} == {
        "a": ([0, 2], [1, 4]),
        "b": ([0, 1], [-1, -2]),
    }


def test_stamps_of_zero_are_replaced_by_the_times_of_the_recorder(tmp_path: Path) -> None:
    path = tmp_path / "bag"
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/joint_states", KIND, typestore=STORE)
        for i in range(3):
            writer.write(connection, 7_000_000_000 + 500_000_000 * i, state(0, ["a"], [i]))
    np.testing.assert_allclose(read_joint_states(path)["a"].times, [0, 0.5, 1])


def test_topics_are_chosen_by_name(tmp_path: Path) -> None:
    topics: dict[str, list[Message]] = {"/left/js": [(1, ["a"], [1])], "/right/js": [(1, ["a"], [2])]}
    path = write_bag(tmp_path / "bag", topics)
    with raises(raycam.SettingsError, code="missing_value", mentions=["/left/js, /right/js", ":/left/js"]):
        read_joint_states(path)
    assert read_joint_states(f"{path}:/right/js")["a"].positions == [2]
    with raises(raycam.SettingsError, code="unknown_name", mentions=["'/rigth/js'", "'/right/js'"]):
        read_joint_states(f"{path}:/rigth/js")
    both = write_bag(tmp_path / "other", {**topics, "/joint_states": [(1, ["a"], [3])]})
    assert read_joint_states(both)["a"].positions == [3]


def damage_text(path: Path) -> None:
    path.write_bytes(b"not a bag")


def cut_half(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def change_serialization(path: Path) -> None:
    with sqlite3.connect(path) as connection:
        connection.execute("update topics set serialization_format = 'protobuf' where id = 2")


def change_message(data: bytes) -> Callable[[Path], None]:
    def change(path: Path) -> None:
        with sqlite3.connect(path) as connection:
            connection.execute("update messages set data = ? where topic_id = 2", (data,))

    return change


GOOD = state(1, ["a"], [0.5])
FAULTS: dict[str, tuple[str, Callable[[Path], None], Any]] = {
    "text": ("mcap", damage_text, fault("unknown_format", "MCAP or SQLite")),
    "cut": ("db3", cut_half, fault("damaged_data", ".db3")),
    "cut mcap": ("mcap", cut_half, fault("damaged_data", ".mcap")),
    "cut message": ("db3", change_message(GOOD[:30]), fault("truncated_file", "/joint_states", "30")),
    "huge count": ("db3", change_message(GOOD[:12] + b"\xff" * 8), fault("truncated_file", "/joint_states")),
    "other encoding": ("db3", change_message(b"\0\7\0\0" + GOOD[4:]), fault("wrong_format", "00070000")),
    "not a number": (
        "db3",
        change_message(state(1, ["a"], [np.nan])),
        fault("out_of_range", "/joint_states"),
    ),
    "lengths": (
        "db3",
        change_message(state(1, ["a", "b"], [1])),
        fault("damaged_data", "2 names", "1 positions"),
    ),
    "empty": ("db3", change_message(b""), fault("wrong_format", "/joint_states")),
    "too long": (
        "db3",
        change_message(GOOD + bytes(2**20)),
        fault("budget_exceeded", "/joint_states", str(len(GOOD) + 2**20), str(2**20)),
    ),
    "serialization": ("db3", change_serialization, fault("wrong_format", "/joint_states", "'protobuf'")),
}


@pytest.mark.parametrize("case", FAULTS)
def test_damaged_bags_are_refused(tmp_path: Path, case: str) -> None:
    plugin, damage, expected = FAULTS[case]
    folder = write_bag(
        tmp_path / "bag", {"/joint_states": [(float(i), ["a"], [0.5]) for i in range(3)]}, plugin
    )
    path = next(folder.glob(f"*.{plugin}"))
    damage(path)
    with raises(raycam.FormatError, **expected):
        read_joint_states(path)


def test_bags_without_joint_states_are_refused(tmp_path: Path) -> None:
    with raises(raycam.FormatError, code="missing_value", mentions=["JointState"]):
        read_joint_states(write_bag(tmp_path / "bag", {}))
    (tmp_path / "empty").mkdir()
    with raises(raycam.FormatError, code="file_not_found", mentions=[".mcap"]):
        read_joint_states(tmp_path / "empty")
    with pytest.raises(FileNotFoundError):
        read_joint_states(tmp_path / "none.mcap")


def test_trajectory_of_a_bag_moves_the_robot(arm: Path, tmp_path: Path) -> None:
    messages: list[Message] = [
        (5.0, ["push", "turn", "follow"], [0.1, 0.0, 9.0]),
        (6.0, ["turn"], [1.0]),
        (7.0, ["push"], [0.3]),
    ]
    path = write_bag(tmp_path / "bag", {"/joint_states": messages})
    robot = raycam.load(arm).robots["arm"]
    with warns(raycam.Notice, code="ignored_key", mentions=["follow", "'arm'"]):
        times, vectors = read_trajectory(robot, path)
    np.testing.assert_array_equal(times, [0, 1, 2])
    np.testing.assert_allclose(vectors, [[0, 0.1], [1, 0.2], [1, 0.3]], rtol=0, atol=1e-15)
    other = write_bag(tmp_path / "other", {"/joint_states": [(1.0, ["knee"], [1])]})
    with raises(raycam.WorldError, code="unknown_name", mentions=["knee", "turn, push"]):
        read_trajectory(robot, other)
    shutil.rmtree(other)


@pytest.mark.parametrize("plugin", PLUGINS)
def test_messages_beyond_the_limit_raise_an_error_in_both_kinds_of_bag(tmp_path: Path, plugin: str) -> None:
    names = [f"joint_{number}" for number in range(60_000)]
    path = write_bag(tmp_path / "bag", {"/joint_states": [(1, names, [0.0] * 60_000)]}, plugin)
    with raises(raycam.FormatError, code="budget_exceeded", mentions=["/joint_states", str(2**20)]):
        read_joint_states(path)
