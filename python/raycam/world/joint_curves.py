"""Times at which keyframes follow the curved path of a robot's link within a tolerance."""

from __future__ import annotations

import numpy as np

from ..arguments import Floats
from ..errors import WorldError
from ..robots import JointMotion, Robot, quaternions_of

__all__ = ["MAX_DEVIATION", "curve_times", "limit_turns"]

MAX_DEVIATION = 1e-5
"""Maximum distance in metres between the path that keyframes describe and the exact path."""
MAX_TURN = 0.25
"""Maximum sum of the absolute changes of all joint values between two keyframes, in radians and metres."""
MAX_KEYFRAMES = 2_000_000
"""Maximum number of keyframes of an object or a camera that replace a robot's joint keyframes."""


def curve_times(robot: Robot, motion: JointMotion, link: str, on_link: Floats, reach: float) -> Floats:
    """Returns the times [m] of keyframes for a body on a link.

    The times include all times of the motion. The body's origin is at `on_link` [3] in the link's coordinates, and its
    points are within `reach` metres of this origin. If the origin moves along straight lines between the times, and the
    rotation follows the shorter arc, no point deviates by more than `MAX_DEVIATION` from the path of the joints. The
    deviation is measured in the middle between two times; it decreases with the square of their distance. Raises
    `WorldError` for too many keyframes.
    """
    times = motion.times
    while True:
        counts = np.ceil(np.sqrt(_deviations(robot, motion, link, on_link, reach, times) / MAX_DEVIATION))
        if (counts <= 1).all():
            return times
        times = _split(robot, times, counts)


def limit_turns(robot: Robot, motion: JointMotion) -> JointMotion:
    """Returns the motion with additional times, where joints change too much between two times.

    Between two times of the result, joints change by at most `MAX_TURN`. Rotations by half a turn and more between two
    times would be ambiguous. Raises `WorldError` for too many times.
    """
    turns = np.abs(np.diff(motion.vectors, axis=0)).sum(axis=1)
    times = _split(robot, motion.times, np.ceil(turns / MAX_TURN))
    return JointMotion(times, motion.at_all(times), motion.whole_video)


def _split(robot: Robot, times: Floats, counts: Floats) -> Floats:
    """Returns times [m] that divide each interval between `times` [n] into equal parts.

    `counts` [n - 1] are the numbers of parts; at least one part is used.
    """
    parts = np.maximum(counts, 1).astype(np.int64)
    if parts.sum() > MAX_KEYFRAMES:
        raise WorldError(
            f"video.keyframe: robot {robot.name!r} requires more than {MAX_KEYFRAMES} keyframes of an object or a "
            "camera; use fewer or slower joint keyframes",
            code="too_large",
        )
    first = np.repeat(np.cumsum(parts) - parts, parts)
    fraction = (np.arange(parts.sum()) - first) / np.repeat(parts, parts)
    starts, lengths = np.repeat(times[:-1], parts), np.repeat(np.diff(times), parts)
    return np.append(starts + fraction * lengths, times[-1])


def _deviations(
    robot: Robot, motion: JointMotion, link: str, on_link: Floats, reach: float, times: Floats
) -> Floats:
    """Bounds [n - 1] of the deviation in metres in the middle between two times [n]."""
    middles = 0.5 * (times[:-1] + times[1:])
    ends, exact = (robot.pose(link, motion.at_all(moments)) for moments in (times, middles))
    places, place = (poses[:, :3, :3] @ on_link + poses[:, :3, 3] for poses in (ends, exact))
    shift = np.linalg.norm(0.5 * (places[:-1] + places[1:]) - place, axis=1)
    turns, turn = (quaternions_of(poses[:, :3, :3]) for poses in (ends, exact))
    before, after = turns[:-1], turns[1:]
    middle = before + np.where((before * after).sum(axis=1, keepdims=True) < 0, -after, after)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    half_angle = np.minimum(*(np.linalg.norm(middle + sign * turn, axis=1) for sign in (-1.0, 1.0)))
    found: Floats = shift + 2.0 * half_angle * reach
    return found
