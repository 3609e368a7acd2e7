"""Compares the kinematics of many URDF files with pinocchio and yourdfpy.

    python benchmarks/robot_kinematics.py FOLDER

Run the script in the project's root; it requires pin and yourdfpy. FOLDER contains URDF files, for example
the unpacked wheel of example-robot-data from PyPI. The script compares the poses of all links, and Jacobians.
It prints a Markdown row per robot, and a summary. Joint values are random, within the joints' limits and
within one turn. The exit status is 1 if pinocchio differs by more than 1e-12, or if yourdfpy does so on a
robot whose joints it supports.

yourdfpy supports revolute, continuous, prismatic and fixed joints. If a robot has other joints, or joints
that mimic a mimic joint or an unknown joint, the column of yourdfpy contains the reason why it was not
compared.
"""

from __future__ import annotations

import argparse
import logging
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import raycam
import yourdfpy
from raycam.robots import Robot
from raycam.robots.urdf import read_urdf

TOLERANCE = 1e-12
LARGE = 60
"""Number of values from which a robot is compared at fewer vectors."""


def draw_values(robot: Robot, count: int, rng: np.random.Generator) -> np.ndarray:
    """Returns random joint vectors [count, k] within the limits."""
    kinematics = robot._kinematics
    values = rng.normal(size=(count, kinematics.size))
    for name, joint in kinematics.joints.items():
        start = kinematics.starts[name]
        if joint.type == "floating":
            turn = values[:, start + 3 : start + 7]
            turn /= np.linalg.norm(turn, axis=1, keepdims=True)
        elif joint.type != "planar":
            low, high = max(joint.lower, -np.pi), min(joint.upper, np.pi)
            values[:, start] = rng.uniform(low, high, count) if low < high else low
    return values


def pinocchio_vector(robot: Robot, model: Any, values: np.ndarray) -> np.ndarray:
    """Returns the configuration of pinocchio's model for one joint vector.

    The configuration also contains the values of mimic joints.
    """
    vector = pin.neutral(model)
    for name, joint in robot.description.joints.items():
        if joint.type == "fixed":
            continue
        place = model.joints[model.getJointId(name)]
        own = robot._kinematics._values(joint, values[None])[0]
        if joint.type == "planar":
            own = np.array([own[0], own[1], np.cos(own[2]), np.sin(own[2])])
        elif place.nq == 2:
            own = np.array([np.cos(own[0]), np.sin(own[0])])
        vector[place.idx_q : place.idx_q + place.nq] = own
    return vector


def has_frame(model: Any, link: str) -> bool:
    """Returns False if pinocchio has merged the link's frame into the frame of another link."""
    return bool(model.existFrame(link, pin.FrameType.BODY))


def compare_pinocchio(robot: Robot, model: Any, values: np.ndarray) -> tuple[float, float]:
    """Returns the largest differences of the poses, and of the last link's Jacobian."""
    data, links, worst = model.createData(), robot.links, 0.0
    poses = robot._kinematics.poses(values)
    frames = {link: model.getFrameId(link, pin.FrameType.BODY) for link in links if has_frame(model, link)}
    for number, one in enumerate(values):
        pin.framesForwardKinematics(model, data, pinocchio_vector(robot, model, one))
        for link, frame in frames.items():
            worst = max(worst, float(abs(data.oMf[frame].homogeneous - poses[link][number]).max()))
    joints = robot._kinematics.joints
    if not joints or any(joint.type in ("planar", "floating") for joint in joints.values()):
        return worst, np.nan
    pin.computeJointJacobians(model, data, pinocchio_vector(robot, model, values[-1]))
    pin.updateFramePlacements(model, data)
    link = list(frames)[-1]
    whole = pin.getFrameJacobian(model, data, frames[link], pin.LOCAL_WORLD_ALIGNED)
    expected = np.zeros((6, len(joints)))
    order = list(joints)
    for name, joint in robot.description.joints.items():
        if joint.type != "fixed":
            source = robot._kinematics._sources[name]
            leader = next(one for one in order if robot._kinematics.starts[one] == source.start)
            column = whole[:, model.joints[model.getJointId(name)].idx_v]
            expected[:, order.index(leader)] += source.multiplier * column
    return worst, float(abs(expected - robot.jacobian(link, values[-1])).max(initial=0.0))


def reason_without_yourdfpy(robot: Robot) -> str:
    """Returns the reason why yourdfpy cannot evaluate a robot, or an empty string."""
    joints = robot.description.joints
    kinds = {joint.type for joint in joints.values()} & {"planar", "floating"}
    if kinds:
        return f"{' and '.join(sorted(kinds))} joint"
    if any(joint.mimic and joints[joint.mimic[0]].mimic for joint in joints.values()):
        return "a joint mimics a mimicking joint"
    if any("mimics an" in str(notice) for notice in robot.description.notices):
        return "a joint mimics an unknown joint"
    return ""


def compare_yourdfpy(robot: Robot, path: Path, values: np.ndarray) -> float:
    """Returns the largest difference of the poses."""
    judge = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
    joints, worst = robot._kinematics.joints, 0.0
    poses = robot._kinematics.poses(values)
    for number, one in enumerate(values):
        judge.update_cfg({name: one[robot._kinematics.starts[name]] for name in joints})
        for link in robot.links:
            expected = judge.get_transform(link, judge.base_link)
            worst = max(worst, float(abs(expected - poses[link][number]).max()))
    return worst


def compare(path: Path, count: int, rng: np.random.Generator) -> tuple[str, bool] | None:
    """Returns a robot's row, and True if it agrees.

    Returns None for a file that raycam or pinocchio refuses.
    """
    try:
        robot = Robot.at_zero(path.stem, read_urdf(path.read_bytes(), path.name), np.eye(4))
        model = pin.buildModelFromXML(path.read_text(encoding="utf-8"))
    except (raycam.Error, ValueError, RuntimeError) as error:
        print(f"{path.name}: refused: {str(error).splitlines()[0][:120]}", file=sys.stderr)
        return None
    values = draw_values(robot, max(1, count // 10) if len(robot.values) > LARGE else count, rng)
    poses, jacobian = compare_pinocchio(robot, model, values)
    reason, other = reason_without_yourdfpy(robot), 0.0
    if not reason:
        try:
            other = compare_yourdfpy(robot, path, values[: max(1, len(values) // 10)])
        except Exception as error:
            reason = f"{type(error).__name__}: {str(error)[:60]}"
    row = f"| {path.name} | {len(robot.links)} | {len(robot.values)} | {len(values)} | {poses:.1e} | {jacobian:.1e}"
    shown = reason or f"{other:.1e}"
    return f"{row} | {shown} |", max(poses, other, np.nan_to_num(jacobian)) <= TOLERANCE


def main() -> None:
    """Compares the robots of a folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--vectors", type=int, default=1000, help="number of joint vectors per robot")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    logging.disable(logging.CRITICAL)
    rng = np.random.default_rng(0)
    print("| robot | links | values | vectors | poses, pinocchio | Jacobian, pinocchio | poses, yourdfpy |")
    print("|---|--:|--:|--:|--:|--:|--:|")
    results = []
    for path in sorted(options.folder.rglob("*.urdf")):
        found = compare(path, options.vectors, rng)
        if found is not None:
            results.append(found[1])
            print(found[0], flush=True)
    print(f"\n{sum(results)} of {len(results)} robots agree to {TOLERANCE:g}")
    sys.exit(0 if all(results) else 1)


if __name__ == "__main__":
    main()
