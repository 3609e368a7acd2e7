"""Sliders for the joints of a world's robots in a live view."""

from __future__ import annotations

import math
import threading
from functools import partial

from ..robots import WIDTHS, Robot
from .controls import Control, Controls
from .scene.edits import Edits

__all__ = ["JointSliders"]

MAX_SLIDERS = 200
"""Maximum number of joints with a slider; a text reports the number of joints without a slider."""
STEP = 0.001
"""Step of the sliders in radians and metres."""
UNLIMITED_RANGE = 1.0
"""Range in metres on both sides of the current value, for a prismatic joint without limits."""


class JointSliders:
    """One slider for each joint with one value.

    Moving a slider moves the robot; undo restores the joint. Sliders are in the folder `Joints of ROBOT`. Sliders
    range from the lower to the upper limit, and from -π to π for continuous joints. They are updated after undo,
    after a script's changes, and when the file is loaded again. A read-only view has no sliders.
    """

    def __init__(self, controls: Controls, edits: Edits) -> None:
        self._controls, self._edits = controls, edits
        self._sliders: dict[tuple[str, str], Control] = {}
        self._others: list[Control] = []
        self._shown: tuple[object, ...] = ()
        self._lock = threading.RLock()
        self._moved = threading.local()
        if edits.allowed:
            edits.listen(self)
            self.rebase()

    def rebase(self) -> None:
        """Shows the joint values of the current world."""
        with self._lock:
            robots = list(self._edits.world.robots.values())
            described = tuple((robot.name, robot.joints, tuple(robot.limits.items())) for robot in robots)
            if described != self._shown:
                self._shown = described
                self._replace(robots)
                return
            if getattr(self._moved, "is_moving", False):
                # Other sliders are not updated: their joints do not change, and they may already be
                # newer than the world.
                return
            for robot in robots:
                for joint, value in _single_values(robot).items():
                    slider = self._sliders.get((robot.name, joint))
                    if slider is not None and slider.value != value:
                        low, high = _range(robot, joint, value)
                        slider.set_range(min(low, value), max(high, value), value)

    def _replace(self, robots: list[Robot]) -> None:
        """Removes all sliders, and adds sliders for these robots."""
        for control in [*self._sliders.values(), *self._others]:
            control.remove()
        self._sliders, self._others = {}, []
        left = [(robot, joint, value) for robot in robots for joint, value in _single_values(robot).items()]
        for robot, joint, value in left[:MAX_SLIDERS]:
            low, high = _range(robot, joint, value)
            folder = self._controls.add_folder(f"Joints of {robot.name}")
            slider = folder.add_slider(
                joint, min=min(low, value), max=max(high, value), step=STEP, value=value
            )
            slider.on_change(partial(self._move, robot.name, joint))
            self._sliders[robot.name, joint] = slider
        if len(left) > MAX_SLIDERS:
            text = (
                f"{len(left) - MAX_SLIDERS} of {len(left)} joints have no slider; the limit is {MAX_SLIDERS}"
            )
            self._others.append(self._controls.add_text("Joints", text, editable=False))

    def _move(self, robot: str, joint: str, slider: Control) -> None:
        """Moves a joint to the slider's value.

        Consecutive changes of one slider are one step of undo.
        """
        self._moved.is_moving = True
        try:
            self._edits.change(
                lambda world: world.set_joints(robot, {joint: float(slider.value)}), ("joint", robot, joint)
            )
        finally:
            self._moved.is_moving = False


def _single_values(robot: Robot) -> dict[str, float]:
    """The values of the joints that have one value and a range, in the order of the file."""
    widths = [WIDTHS[robot.description.joints[joint].type] for joint in robot.joints]
    found, start = {}, 0
    for joint, width in zip(robot.joints, widths, strict=True):
        low, high = robot.limits[joint]
        if width == 1 and low < high:
            found[joint] = float(robot.values[start])
        start += width
    return found


def _range(robot: Robot, joint: str, value: float) -> tuple[float, float]:
    """The minimum and maximum of a joint's slider."""
    low, high = robot.limits[joint]
    turns = robot.description.joints[joint].type != "prismatic"
    reach = math.pi if turns else UNLIMITED_RANGE
    middle = 0.0 if turns else value
    return (
        low if math.isfinite(low) else min(middle, high) - reach,
        high if math.isfinite(high) else max(middle, low) + reach,
    )
