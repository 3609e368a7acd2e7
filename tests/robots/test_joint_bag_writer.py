"""Bags of joint states, read back by rosbags and by raycam."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.robots import read_joint_states, write_joint_states
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from support.raises import raises

TIMES = [0.0, 0.25, 1.0]
NAMES = ["a", "joint_of_seven", "ü"]


@pytest.mark.parametrize("count", [0, 1, 3])
def test_rosbags_reads_the_positions_and_stamps(tmp_path: Path, count: int) -> None:
    values = np.random.default_rng(2).normal(size=(3, count))
    path = tmp_path / "states.mcap"
    names = NAMES[:count]
    write_joint_states(path, dict(zip(names, values.T, strict=True)), TIMES, topic="/arm/js", start_time=5)
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        messages = [
            (connection.topic, logged, reader.deserialize(data, connection.msgtype))
            for connection, logged, data in reader.messages()
        ]
    assert [topic for topic, _, _ in messages] == ["/arm/js"] * 3
    for (_, logged, message), time, row in zip(messages, TIMES, values, strict=True):
        assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == logged == 1e9 * (5 + time)
        assert list(message.name) == names
        np.testing.assert_array_equal(message.position, row)
        assert len(message.velocity) == len(message.effort) == 0


def test_raycam_reads_its_own_bags(tmp_path: Path) -> None:
    write_joint_states(tmp_path / "a.mcap", {"a": [1, 2, 3], "b": [4, 5, 6]}, TIMES)
    found = read_joint_states(tmp_path / "a.mcap")
    assert {name: track.positions.tolist() for name, track in found.items()} == {
        "a": [1, 2, 3],
        "b": [4, 5, 6],
    }
    np.testing.assert_allclose(found["b"].times, TIMES, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "joints", "times", "code"),
    [
        ("a.bag", {"a": [1.0]}, [0.0], "unknown_format"),
        ("a.mcap", {"a": [1.0]}, [0.0, 1.0], "wrong_shape"),
        ("a.mcap", {"a": [np.nan]}, [0.0], "out_of_range"),
        ("a.mcap", {"a": [1.0, 2.0]}, [1.0, 1.0], "unordered_times"),
        ("a.mcap", {"a": [1.0]}, [-2.0], "out_of_range"),
        ("a.mcap", {"a": [1.0]}, [np.inf], "out_of_range"),
    ],
)
def test_invalid_states_are_refused(
    tmp_path: Path, name: str, joints: dict[str, list[float]], times: list[float], code: str
) -> None:
    with raises(raycam.SettingsError, code=code):
        write_joint_states(tmp_path / name, joints, times)
    assert not (tmp_path / name).exists()


def test_writing_without_mcap_raises(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with raises(raycam.SettingsError, code="missing_dependency", mentions=["raycam[mcap]"]):
        write_joint_states(tmp_path / "a.mcap", {"a": [1.0]}, [0.0])
