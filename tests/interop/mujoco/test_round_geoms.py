"""Depth of round geoms, compared with MuJoCo's rays."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
import raycam
from raycam.interop.mujoco.model import CAPSULE, CYLINDER, ELLIPSOID, SPHERE
from raycam.interop.mujoco.round_geoms import round_distances

MODEL = """<mujoco>
  <asset><texture name="t" type="2d" builtin="checker" rgb1="1 0 0" rgb2="0 1 0" width="32" height="32"/>
    <material name="m" texture="t"/></asset>
  <worldbody>
  <geom name="floor" type="plane" size="3 3 1" pos="0 0 -.6"/>
  <geom name="s" type="sphere" size="0.3"/>
  <geom name="c" type="capsule" size="0.2 0.4" pos="1 0 0" euler="30 0 0"/>
  <geom name="y" type="cylinder" size="0.2 0.4" pos="2 0 0" euler="60 10 0"/>
  <geom name="e" type="ellipsoid" size="0.2 0.3 0.4" pos="3 0 0" euler="0 30 0"/>
  <geom name="st" type="sphere" size="0.3" pos="0 1 .5" material="m"/>
  <geom name="et" type="ellipsoid" size="0.2 0.3 0.4" pos="1 1 .5" euler="0 30 0" material="m"/>
  <geom name="b" type="box" size="0.2 0.3 0.4" pos="2 1 .5" euler="0 30 0"/>
  <camera name="a" pos="1.5 -4 1" xyaxes="1 0 0 0 0.2 1" fovy="45" resolution="80 40"/>
  <camera name="inside" pos="1 .05 0" xyaxes="1 0 0 0 0 1" fovy="60" resolution="24 16"/>
</worldbody></mujoco>"""


@pytest.mark.parametrize("name", ["a", "inside"])
def test_depth_agrees_with_mujoco_rays_to_a_micrometre(name: str) -> None:
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    scene = raycam.from_mujoco(model, data)
    camera = scene.world.camera(name)
    depth = scene.depth(camera)
    instance = raycam.render(scene.world, camera, channels=["instance"])["instance"]
    assert depth.shape == instance.shape
    assert ((instance < 0) == np.isinf(depth)).all()
    compared = set()
    for v, u in np.argwhere(instance >= 0):
        (origin,), (direction,) = camera.rays(np.array([[u, v]]) + 0.5)
        geom = np.array([-1], np.int32)
        distance = mujoco.mj_ray(model, data, origin, direction, None, 1, -1, geom, np.zeros(3))
        if scene.elements[instance[v, u]][1] == geom[0]:
            compared.add(model.geom(geom[0]).name)
            expected = distance * direction @ camera.R[2]
            # MuJoCo's planes and boxes are compared in float32.
            assert depth[v, u] == pytest.approx(expected, rel=0, abs=1e-6), model.geom(geom[0]).name
    assert compared == ({"floor", "s", "c", "y", "e", "st", "et", "b"} if name == "a" else {"c"})


@pytest.mark.parametrize("kind", [SPHERE, CAPSULE, ELLIPSOID, CYLINDER])
def test_distances_of_random_rays_agree_with_mujoco(kind: int) -> None:
    random = np.random.default_rng(kind)
    size, rotation = random.uniform(0.2, 0.6, 3), np.empty(9)
    mujoco.mju_quat2Mat(rotation, (quaternion := random.normal(size=4)) / np.linalg.norm(quaternion))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation.reshape(3, 3), random.normal(size=3)
    origins = pose[:3, 3] + random.normal(size=(500, 3)) * np.array([0.1, 1.0])[np.arange(500) % 2, None]
    directions = random.normal(size=(500, 3))
    directions[::5] = pose[:3, random.integers(0, 3, 100)].T  # along the axes
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    found = round_distances(kind, size, pose, origins, directions)
    for origin, direction, distance in zip(origins, directions, found, strict=True):
        expected = mujoco.mju_rayGeom(
            pose[:3, 3], pose[:3, :3].ravel(), size, origin, direction, kind, np.zeros(3)
        )
        assert distance == pytest.approx(np.inf if expected < 0 else expected, abs=1e-9)
    assert 50 < np.isfinite(found).sum() < 450
