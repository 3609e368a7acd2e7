"""Poses of geoms and sites after `MujocoScene.update`."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
import raycam

MODEL = """<mujoco><worldbody>
  <geom name="floor" type="plane" size="2 2 1"/>
  <body pos="0 0 1"><freejoint/><geom name="ball" type="ellipsoid" size=".1 .2 .3"/>
    <site name="tip" type="box" size=".1 .1 .2" pos="0 0 .3"/></body>
  <body pos="1 0 1"><freejoint/><geom name="box" type="box" size=".1 .2 .3"/></body>
  <camera name="side" pos="0 -3 1" xyaxes="1 0 0 0 0 1"/></worldbody></mujoco>"""


@pytest.fixture
def state() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A model with two free bodies in its initial state."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def test_all_geoms_and_sites_follow_the_state(state: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, data = state
    scene = raycam.from_mujoco(model, data, sites=(0,))
    start = {item.name: item.matrix for item in scene.world.objects}
    random = np.random.default_rng(1)
    for moved in ([True, False], [True, True], [False, False], [False, True]):
        for body in np.flatnonzero(moved):
            data.qpos[7 * body :][:7] = [0.3, -0.2, 2.0 + body, 0.5, 0.5, -0.5, 0.5]
            data.qpos[7 * body] += random.random()
        mujoco.mj_forward(model, data)
        scene.update(data)
        for item in scene.world.objects:
            element = data.site(item.name) if item.name == "tip" else data.geom(item.name)
            of_model = model.site(item.name) if item.name == "tip" else model.geom(item.name)
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = element.xmat.reshape(3, 3), element.xpos
            first = np.eye(4)
            mujoco.mju_quat2Mat(rotation := np.empty(9), of_model.quat)
            first[:3, :3], first[:3, 3] = rotation.reshape(3, 3), of_model.pos
            body = int(of_model.bodyid[0])
            first[:3, 3] += model.body_pos[body]
            scale = np.linalg.solve(first, start[item.name])
            np.testing.assert_allclose(item.matrix, pose @ scale, atol=1e-12)


def test_update_ignores_cameras_that_were_added_to_the_world(
    state: tuple[mujoco.MjModel, mujoco.MjData],
) -> None:
    model, data = state
    scene = raycam.from_mujoco(model, data)
    extra = scene.world.camera("side").resized((8, 8))
    scene.world.add_camera(extra, "extra")
    model.cam_pos[0] = [0, -4, 1]
    mujoco.mj_forward(model, data)
    scene.update(data)
    np.testing.assert_allclose(scene.world.camera("side").C, [0, -4, 1])
    np.testing.assert_allclose(scene.world.camera("extra").C, [0, -3, 1])


def test_matrices_of_thin_ellipsoids_are_rigid() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><geom name="leaf" type="ellipsoid" size="0.03 0.01 0.0006" euler="10 20 30"/>'
        "</worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    leaf = raycam.from_mujoco(model, data).world.objects[0]
    rotation = leaf.matrix[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(rotation, data.geom_xmat[0].reshape(3, 3), atol=1e-12)
