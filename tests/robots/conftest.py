"""Small robots for the tests of this folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

ARM = """<?xml version="1.0"?>
<robot name="arm">
  <material name="orange"><color rgba="1 0.5 0 1"/></material>
  <link name="base"><visual><geometry><cylinder radius="0.1" length="0.2"/></geometry></visual></link>
  <link name="upper">
    <visual>
      <origin xyz="0 0 0.25"/><geometry><box size="0.1 0.1 0.5"/></geometry><material name="orange"/>
    </visual>
    <visual><geometry><sphere radius="0.08"/></geometry></visual>
    <collision><geometry><capsule radius="0.08" length="0.5"/></geometry></collision>
  </link>
  <link name="slide"><visual><geometry><box size="0.05 0.05 0.3"/></geometry></visual></link>
  <link name="finger"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 0.1" rpy="0.1 0.2 0.3"/><axis xyz="0 2 0"/>
    <limit lower="-1" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="push" type="prismatic">
    <parent link="upper"/><child link="slide"/><origin xyz="0 0 0.5"/><axis xyz="0 0 1"/>
    <limit lower="0.05" upper="0.3" effort="1" velocity="1"/>
  </joint>
  <joint name="follow" type="prismatic">
    <parent link="slide"/><child link="finger"/><axis xyz="1 0 0"/><mimic joint="push" multiplier="-2" offset="0.1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
</robot>
"""


def random_robot(seed: int, links: int = 12) -> str:
    """The text of a URDF with random joints, mimics and branches."""
    rng = np.random.default_rng(seed)
    parts = [f'<link name="l{number}"/>' for number in range(links)]
    settable: list[str] = []

    def numbers(count: int) -> str:
        return " ".join(repr(float(value)) for value in rng.uniform(-2, 2, count))

    def axis() -> str:  # normalised, because yourdfpy uses the axis of a prismatic joint as it is
        values = rng.normal(size=3)
        return " ".join(repr(float(value)) for value in values / np.linalg.norm(values))

    for number in range(1, links):
        kind = str(rng.choice(["revolute", "continuous", "prismatic", "fixed"]))
        mimic = ""
        if kind != "fixed" and settable and rng.random() < 0.3:
            mimic = f'<mimic joint="{rng.choice(settable)}" multiplier="{rng.uniform(-2, 2)}" offset="0.25"/>'
        elif kind != "fixed":
            settable.append(f"j{number}")
        parts.append(
            f'<joint name="j{number}" type="{kind}"><parent link="l{rng.integers(number)}"/>'
            f'<child link="l{number}"/><origin xyz="{numbers(3)}" rpy="{numbers(3)}"/><axis xyz="{axis()}"/>'
            f'<limit lower="-9" upper="9" effort="1" velocity="1"/>{mimic}</joint>'
        )
    return f'<robot name="random">{"".join(parts)}</robot>'


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """The file of a small arm made of primitives."""
    path = tmp_path / "arm.urdf"
    path.write_text(ARM, encoding="utf-8")
    return path
