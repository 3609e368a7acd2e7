"""Writes the description of a robot arm with six joints and a gripper, as a URDF file."""

from __future__ import annotations

ORANGE, WHITE, BLACK = "1 0.28 0.03 1", "0.85 0.85 0.83 1", "0.05 0.05 0.055 1"


def tube(start: str, turn: str, radius: float, length: float, color: str) -> str:
    """Returns a visual of a URDF link: a cylinder."""
    return (
        f'<visual><origin xyz="{start}" rpy="{turn}"/><geometry><cylinder radius="{radius}" length="{length}"/>'
        f'</geometry><material name="{color}"><color rgba="{color}"/></material></visual>'
    )


def limb(length: float, radius: float) -> str:
    """Returns the visuals of a link along z.

    The visuals are a motor across the joint's axis, a collar and a tube.
    """
    across, along = "1.5708 0 0", "0 0 0"
    return (
        tube("0 0 0", across, radius * 1.25, radius * 2.9, ORANGE)
        + tube("0 0 0", across, radius * 1.05, radius * 3.2, BLACK)
        + tube(f"0 0 {length / 2}", along, radius, length, WHITE)
        + tube(f"0 0 {length * 0.5}", along, radius * 1.06, length * 0.12, ORANGE)
    )


def link(name: str, shapes: str) -> str:
    """Returns a link of a URDF file."""
    return f'<link name="{name}">{shapes}</link>'


def joint(name: str, parent: str, child: str, place: str, axis: str) -> str:
    """Returns a joint of a URDF file."""
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{place}"/>'
        f'<axis xyz="{axis}"/><limit lower="-3.2" upper="3.2" effort="1" velocity="1"/></joint>'
    )


def finger(side: int) -> str:
    """Returns a finger of the gripper."""
    return (
        f'<visual><origin xyz="0 {0.05 * side} 0.13"/><geometry><box size="0.03 0.018 0.11"/></geometry>'
        f'<material name="{BLACK}"/></visual>'
    )


def urdf() -> str:
    """Returns the description of an arm with six joints and a gripper."""
    base = tube("0 0 0.03", "0 0 0", 0.16, 0.06, BLACK) + tube("0 0 0.12", "0 0 0", 0.115, 0.14, WHITE)
    hand = (
        tube("0 0 0.03", "0 0 0", 0.05, 0.05, BLACK)
        + '<visual><origin xyz="0 0 0.065"/><geometry><box size="0.06 0.15 0.035"/></geometry>'
        + f'<material name="{ORANGE}"/></visual>'
    )
    turret = tube("0 0 0.05", "0 0 0", 0.098, 0.12, ORANGE) + tube("0 0 0.14", "1.5708 0 0", 0.1, 0.17, WHITE)
    links = [("base", base), ("turret", turret), ("upper_arm", limb(0.46, 0.07)), ("forearm", limb(0.22, 0.06)),
             ("forearm_roll", tube("0 0 0.1", "0 0 0", 0.05, 0.2, WHITE)), ("wrist", limb(0.1, 0.045)),
             ("hand", hand), ("left_finger", finger(1)), ("right_finger", finger(-1))]  # fmt: skip
    joints = [("turn", "base", "turret", "0 0 0.19", "0 0 1"), ("shoulder", "turret", "upper_arm", "0 0 0.14", "0 1 0"),
              ("elbow", "upper_arm", "forearm", "0 0 0.5", "0 1 0"),
              ("roll", "forearm", "forearm_roll", "0 0 0.22", "0 0 1"),
              ("wrist", "forearm_roll", "wrist", "0 0 0.23", "0 1 0"), ("flange", "wrist", "hand", "0 0 0.1", "0 0 1"),
              ("left", "hand", "left_finger", "0 0 0", "1 0 0"),
              ("right", "hand", "right_finger", "0 0 0", "1 0 0")]  # fmt: skip
    parts = [*(link(*item) for item in links), *(joint(*item) for item in joints)]
    return f'<robot name="arm">{"".join(parts)}</robot>'
