"""Skins and flexes, compared with MuJoCo's visualizer and its rays."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
import raycam
from support.raises import warns

SKIN = """<mujoco><worldbody>
    <body name="a"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .5 0 0" size=".05" group="3"/>
      <body name="b" pos=".5 0 0"><joint axis="0 0 1"/>
        <geom type="capsule" fromto="0 0 0 .5 0 0" size=".05" group="3"/></body></body>
  </worldbody>
  <deformable><skin name="hull" rgba="1 .2 .1 1" inflate="{inflate}"
      vertex="0 -.1 -.1 0 .1 -.1 0 .1 .1 0 -.1 .1 .5 -.1 -.1 .5 .1 -.1 .5 .1 .1 .5 -.1 .1 1 0 0"
      face="0 2 1 0 3 2 0 1 5 0 5 4 1 2 6 1 6 5 2 3 7 2 7 6 3 0 4 3 4 7 4 5 8 5 6 8 6 7 8 7 4 8">
    <bone body="a" bindpos="0 0 0" bindquat="1 0 0 0" vertid="0 1 2 3 4 5 6 7" vertweight="1 1 1 1 .5 .5 .5 .5"/>
    <bone body="b" bindpos=".5 0 0" bindquat="1 0 0 0" vertid="4 5 6 7 8" vertweight=".5 .5 .5 .5 1"/>
  </skin></deformable></mujoco>"""
CLOTH = """<mujoco><option timestep=".005"/><worldbody>
    <flexcomp name="cloth" type="grid" count="6 6 1" spacing=".1 .1 .1" pos="0 0 1" dim="2" radius="0.001" mass="1">
      <pin id="0 5"/><edge equality="true"/></flexcomp></worldbody></mujoco>"""


@pytest.mark.parametrize("inflate", [0, 0.02])
def test_skins_move_as_in_mujocos_visualizer(inflate: float) -> None:
    model = mujoco.MjModel.from_xml_string(SKIN.format(inflate=inflate))
    data = mujoco.MjData(model)
    scene = raycam.from_mujoco(model)
    judge = mujoco.MjvScene(model, maxgeom=100)
    assert scene.elements == [(int(mujoco.mjtObj.mjOBJ_SKIN), 0)]
    for angles in ([0.0, 0.0], [0.5, -0.8], [-1.2, 0.6]):
        data.qpos[:] = angles
        mujoco.mj_forward(model, data)
        mujoco.mjv_updateScene(
            model, data, mujoco.MjvOption(), None, mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL, judge
        )
        scene.update(data)
        expected = np.array(judge.skinvert).reshape(-1, 3)[np.array(model.skin_face)]
        np.testing.assert_allclose(scene.world.triangles(0), expected, rtol=0, atol=2e-6)


def test_flexes_are_hit_where_mujocos_rays_hit_them() -> None:
    model = mujoco.MjModel.from_xml_string(CLOTH)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with warns(raycam.Notice, code="approximated_value", mentions=["cloth", "0.001"]):
        scene = raycam.from_mujoco(model, data)
    for _ in range(60):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    scene.update(data)
    x, y = np.meshgrid(np.linspace(-0.2, 0.2, 9), np.linspace(-0.2, 0.2, 9))
    origins = np.stack([x.ravel(), y.ravel(), np.full(x.size, 3.0)], axis=1)
    found = scene.world.cast_rays(origins, [0, 0, -1], fields=["t"])["t"]
    expected = []
    for origin in origins:
        way, vertex = np.array([0, 0, -1.0]), np.array([-1], np.int32)
        hit = mujoco.mj_rayFlex(
            model, data, 0, False, False, True, False, 0, origin, way, vertex, np.zeros(3)
        )
        expected.append(np.inf if hit < 0 else hit)
    both = np.isfinite(found) & np.isfinite(expected)
    assert both.sum() > 20
    # The tolerance is the body's radius.
    np.testing.assert_allclose(found[both], np.array(expected)[both], rtol=0, atol=2e-3)
