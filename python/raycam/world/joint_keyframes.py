"""Joint keyframes in videos, and joint trajectories from files."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arguments import Floats, floats, real
from ..errors import Notice, WorldError, nearest
from ..io.text_files import decode_text
from ..notices import warn, warn_all
from ..robots import JointMotion, Robot, is_bag, place_camera, read_joint_states
from .joint_curves import curve_times, limit_turns
from .robot_joints import find_robot

if TYPE_CHECKING:
    from .contents import WorldContents

__all__ = ["expand_joint_keyframes", "read_trajectory"]

MAX_KEYFRAMES = 2_000_000
"""Maximum number of keyframes of objects and cameras that replace joint keyframes."""
CAMERA_REACH = 1.0
"""Distance in metres from a moving camera up to which points deviate by at most MAX_DEVIATION in camera axes."""


def expand_joint_keyframes(
    world: WorldContents, description: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, JointMotion]]:
    """Replaces joint keyframes in a video's description by keyframes of objects and cameras.

    Returns the new description, and the motions of robots by name.

    Joint values are interpolated linearly; continuous joints turn in the shorter direction. Objects, and cameras on
    links, get keyframes at each video frame and as many in between as their curved paths require (`curve_times`), so
    that they are exact at the frames and deviate by at most `MAX_DEVIATION` in between. Raises `WorldError` for unknown
    robots, joints and keys, for mirrored objects, and for too many keyframes.
    """
    frames = description.get("keyframe") or []
    if not any(isinstance(frame, Mapping) and "robot" in frame for frame in frames):
        return dict(description), {}
    others = [frame for frame in frames if "robot" not in frame]
    fps = real("video.fps", description.get("fps", 24.0), error=WorldError)
    if not fps > 0:
        raise WorldError(f"video.fps must be positive, got {fps:g}", code="out_of_range")
    names = list(dict.fromkeys(frame["robot"] for frame in frames if "robot" in frame))
    expanded: list[dict[str, Any]] = []
    motions: dict[str, JointMotion] = {}
    alone = not others and description.get("orbit") is None
    present = set(world.cameras)
    for name in names:
        robot = find_robot(world, name)
        motion = _motion(robot, [frame for frame in frames if frame.get("robot") == name], fps, alone)
        if motion is not None:
            motions[name] = motion
            expanded += _object_keyframes(world, robot, motion)
            expanded += _camera_keyframes(robot, motion, present)
        if len(expanded) > MAX_KEYFRAMES:
            raise WorldError(
                f"video.keyframe: robot {robot.name!r} requires more than {MAX_KEYFRAMES} keyframes of objects and "
                "cameras; use a shorter video or slower joints",
                code="too_large",
            )
    return {**description, "keyframe": [*others, *expanded]}, motions


def _motion(robot: Robot, frames: Sequence[Mapping[str, Any]], fps: float, alone: bool) -> JointMotion | None:
    tracks: dict[str, list[tuple[float, Floats]]] = {}
    for frame in frames:
        for key in frame:
            if key not in ("time", "robot", "joints"):
                raise WorldError(
                    f"video.keyframe: {nearest('key', key, ['time', 'robot', 'joints'])}", code="unknown_key"
                )
        joints = frame.get("joints")
        if not isinstance(joints, Mapping):
            raise WorldError(
                f"video.keyframe: joints must be a table of joint names and values, got {joints!r}",
                code="wrong_type",
            )
        time = real("video.keyframe.time", frame.get("time"), what="a time in seconds", error=WorldError)
        for joint, value in joints.items():
            tracks.setdefault(joint, []).append((time, robot._joint_values(joint, value)[0][0]))
    ends = [time for track in tracks.values() for time, _ in track]
    if not ends:
        return None
    times = np.unique(np.concatenate([ends, np.arange(0.0, max(ends), 1.0 / fps)]))
    if len(times) > MAX_KEYFRAMES:
        raise WorldError(
            f"video.keyframe: robot {robot.name!r} moves for {len(times)} frames; the limit is {MAX_KEYFRAMES}; "
            "shorten the video or lower its fps",
            code="too_large",
        )
    vectors = np.tile(robot._values, (len(times), 1))
    for joint, track in tracks.items():
        track.sort(key=lambda pair: pair[0])
        start = robot._kinematics.starts[joint]
        values = np.array([value for _, value in track])
        if robot.description.joints[joint].type == "continuous":
            values = np.unwrap(values, axis=0)
        for column in range(values.shape[1]):
            vectors[:, start + column] = np.interp(times, [time for time, _ in track], values[:, column])
    robot._check_values(vectors)
    vectors, notices = robot._limited(vectors, clamp=False)
    warn_all(notices)
    return limit_turns(robot, JointMotion(times, vectors, alone))


def _camera_keyframes(robot: Robot, motion: JointMotion, present: set[str]) -> list[dict[str, Any]]:
    """Keyframes of the robot's cameras that move."""
    found: list[dict[str, Any]] = []
    for name, link, on_link in robot._cameras:
        if name not in present or np.ptp(robot.pose(link, motion.vectors), axis=0).max() == 0.0:
            continue
        times = curve_times(robot, motion, link, on_link.C, CAMERA_REACH)
        for time, pose in zip(times, robot.pose(link, motion.at_all(times)), strict=True):
            camera = place_camera(on_link, pose)
            matrix = np.column_stack([camera.R.T, camera.C])
            found.append({"time": float(time), "camera": name, "matrix": matrix, "interpolation": "linear"})
    return found


def _object_keyframes(world: WorldContents, robot: Robot, motion: JointMotion) -> list[dict[str, Any]]:
    """Keyframes of the robot's objects that move."""
    found: list[dict[str, Any]] = []
    numbers = {item.name: item.id for item in world.objects}
    for name, link, link_from_mesh in robot._parts:
        poses = robot.pose(link, motion.vectors)
        if np.ptp(poses, axis=0).max() == 0.0:
            continue
        if np.linalg.det(link_from_mesh[:3, :3]) < 0:
            raise WorldError(
                f"object {name!r} is mirrored (a mesh with a negative scale), and keyframes cannot move mirrored"
                " objects; use render_many(joints=...), or mirror the mesh file",
                code="unsupported_feature",
            )
        item = world.objects[numbers[name]]
        offsets = world.triangles(item.id).reshape(-1, 3) - item.matrix[:3, 3]
        reach = float(np.sqrt((offsets**2).sum(axis=1).max(initial=0.0)))
        times = curve_times(robot, motion, link, link_from_mesh[:3, 3], reach)
        matrices = robot.pose(link, motion.at_all(times)) @ link_from_mesh
        found += [
            {"time": float(time), "object": name, "matrix": matrix, "interpolation": "linear"}
            for time, matrix in zip(times, matrices, strict=True)
        ]
    return found


def read_trajectory(robot: Robot, path: str | os.PathLike[str]) -> tuple[Floats, Floats]:
    """Reads joint values over time from a CSV or NPY file, or a ROS 2 bag.

    Returns times [n] in seconds and joint vectors [n, k].

    The first row of a CSV file contains `time` and the joints' names. An NPY array [n, 1 + k] has the time in its first
    column, followed by the joints in the order of `Robot.joints`. From a bag, the `sensor_msgs/JointState` messages are
    read (see `read_joint_states`). The times are the times of all messages with joints of the robot, relative to the
    bag's first joint state. A joint that a message omits is interpolated linearly. Joints without a column keep their
    values. A notice reports joints of a bag that the robot does not have or that cannot be set.

    Raises `OSError` if the file cannot be read, `WorldError` if its contents are invalid, and the errors of
    `read_joint_states`.
    """
    if is_bag(path):
        return _from_bag(robot, path)
    path = Path(path)
    if path.suffix.lower() == ".npy":
        try:
            array = np.load(path, allow_pickle=False)
        except ValueError as error:
            raise WorldError(f"{path}: invalid NPY file: {error}", code="invalid_value") from None
        table = floats(os.fspath(path), array, ("n", 1 + robot._kinematics.size), error=WorldError)
        return table[:, 0], table[:, 1:]
    lines = [line for line in decode_text(path.read_bytes()).splitlines() if line.strip()]
    names = [name.strip() for name in lines[0].split(",")] if lines else []
    if not names or names[0].lower() not in ("time", "t"):
        raise WorldError(
            f'{path}:1: expected the header "time, JOINT, ...", got {lines[0] if lines else ""!r}',
            code="missing_value",
        )
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise WorldError(f"{path}:1: duplicate column {twice[0]!r}", code="duplicate_name")
    rows = []
    for number, line in enumerate(lines[1:], start=2):
        try:
            row = [float(word) for word in line.split(",")]
        except ValueError:
            row = []
        if len(row) != len(names):
            raise WorldError(
                f"{path}:{number}: expected {len(names)} numbers separated by commas, got {line!r}",
                code="wrong_shape",
            )
        rows.append(row)
    table = floats(os.fspath(path), rows, ("n", len(names)), error=WorldError)
    columns = {name: table[:, column] for column, name in enumerate(names) if column}
    vectors, _ = robot._vectors(columns)
    return table[:, 0], vectors


def _from_bag(robot: Robot, path: str | os.PathLike[str]) -> tuple[Floats, Floats]:
    """Times [n] and vectors [n, k] of a bag."""
    tracks = read_joint_states(path)
    known = {name: track for name, track in tracks.items() if name in robot.joints}
    others = sorted(set(tracks) - set(known))
    if not known:
        raise WorldError(
            f"{os.fspath(path)}: the bag has no joint positions for robot {robot.name!r}; joints of the bag: "
            f"{', '.join(others[:10]) or 'none'}; joints of the robot: {', '.join(robot.joints) or 'none'}",
            code="unknown_name",
        )
    if others:
        text = f"{os.fspath(path)}: joints that robot {robot.name!r} does not have or that cannot be set are ignored"
        warn(Notice(text, "ignored_key", others[:3], len(others)))
    times = np.unique(np.concatenate([track.times for track in known.values()]))
    columns = {}
    for name, (moments, positions) in known.items():
        turns = robot.description.joints[name].type == "continuous"
        columns[name] = np.interp(times, moments, np.unwrap(positions) if turns else positions)
    return times, robot._vectors(columns)[0]
