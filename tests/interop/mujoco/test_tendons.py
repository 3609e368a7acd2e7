"""Tendons, compared with the capsules of MuJoCo's visualizer."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
import raycam
from raycam.compat.mujoco import Renderer
from raycam.interop.mujoco.tendons import tendon_segments

WRAPPED = """<mujoco><worldbody><geom name="drum" type="cylinder" size=".1 .1" pos=".4 0 1" euler="90 0 0"/>
    <site name="a" pos="0 0 1"/><site name="c" pos=".5 .4 .4"/><site name="d" pos=".9 .4 .4"/>
    <body pos=".8 0 .9"><joint axis="0 1 0"/><geom size=".03"/><site name="b" pos=".1 0 .1"/></body>
    <site name="side" pos=".4 0 1.2"/></worldbody>
  <tendon><spatial name="rope" width=".02" rgba="1 0 0 1">
    <site site="a"/><geom geom="drum" sidesite="side"/><site site="b"/>
    <pulley divisor="2"/><site site="c"/><site site="d"/></spatial>
    <fixed name="coupling"><joint joint="j" coef="1"/></fixed></tendon></mujoco>""".replace(
    '<joint axis="0 1 0"/>', '<joint name="j" type="slide"/>'
)
BENT = """<mujoco><worldbody><geom name="drum" type="cylinder" size=".1 .1" pos="0 0 1" euler="70 10 0"/>
    <geom name="ball" type="sphere" size=".1" pos=".5 .1 1"/><site name="a" pos="-.4 0 1"/>
    <site name="up" pos="0 0 1.2"/><site name="over" pos=".5 0 1.2"/><site name="in" pos="0 0 1.02"/>
    <site name="m" pos=".25 .05 .9"/>
    <body pos=".9 0 .5"><joint type="slide" axis="-1 0 0"/><geom size=".02"/><site name="b"/></body></worldbody>
  <tendon><spatial name="rope" width=".02"><site site="a"/><geom geom="drum" sidesite="{side}"/><site site="m"/>
    <geom geom="ball" sidesite="over"/><site site="b"/></spatial></tendon></mujoco>"""
HANGING = """<mujoco><option gravity="{gravity}"/><worldbody><site name="a" pos="0 0 1"/>
    <body pos="{place}"><joint name="x" type="slide"/><geom size=".01"/><site name="b"/></body></worldbody>
  <tendon><spatial name="rope" width=".01" {how}><site site="a"/><site site="b"/></spatial></tendon>{more}</mujoco>"""
LIMIT = 'limited="true" range="0 1"'
ROPES = {
    "slack": {},
    "oblique gravity": {"gravity": "2 -1 -9"},
    "steep": {"place": ".05 .02 1.7"},
    "almost vertical": {"place": ".01 0 1.2"},
    "vertical": {"place": "0 0 1.2"},
    "taut": {"place": "1.2 0 1"},
    "no gravity": {"gravity": "0 0 0"},
    "from a length": {"how": 'limited="true" range=".1 1"'},
    "spring": {"how": 'stiffness="2" springlength="0 .9"'},
    "springy limit": {"how": f'stiffness="2" springlength=".1 .9" {LIMIT}'},
    "damped": {"how": f'damping="1" {LIMIT}'},
    "pulled": {"more": '<actuator><motor tendon="rope"/></actuator>'},
}


def drawn_capsules(model: mujoco.MjModel, data: mujoco.MjData) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Start, end and radius of each capsule of tendon 0 in MuJoCo's scene."""
    scene = mujoco.MjvScene(model, maxgeom=200)
    camera, option = mujoco.MjvCamera(), mujoco.MjvOption()
    mujoco.mjv_updateScene(model, data, option, None, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
    geoms = [
        geom
        for geom in scene.geoms[: scene.ngeom]
        if geom.objtype == mujoco.mjtObj.mjOBJ_TENDON and geom.objid == 0
    ]
    ends = [geom.size[2] * np.array(geom.mat)[:, 2] for geom in geoms]
    return [
        (geom.pos - end, geom.pos + end, float(geom.size[0])) for geom, end in zip(geoms, ends, strict=True)
    ]


def assert_same_capsules(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    expected = drawn_capsules(model, data)
    starts, ends, radii = tendon_segments(model, data, 0)
    assert len(starts) == len(expected) > 0
    for index, found in enumerate((starts, ends, radii)):
        wanted = np.array([capsule[index] for capsule in expected])
        np.testing.assert_allclose(found, wanted, rtol=0, atol=2e-6)


def test_wrapped_tendons_have_the_capsules_of_mujocos_visualizer_in_every_state() -> None:
    model = mujoco.MjModel.from_xml_string(WRAPPED)
    data = mujoco.MjData(model)
    counts = set()
    for height in (0.0, -0.4, 0.5):
        data.qpos[0] = height
        mujoco.mj_forward(model, data)
        assert_same_capsules(model, data)
        counts.add(int(data.ten_wrapnum[0]))
    assert len(counts) > 1  # the rope leaves the drum


@pytest.mark.parametrize("side", ["up", "in"])
def test_tendons_bend_around_spheres_and_cylinders_as_in_mujocos_visualizer(side: str) -> None:
    model = mujoco.MjModel.from_xml_string(BENT.format(side=side))
    data = mujoco.MjData(model)
    for place in (0.0, 0.3, 0.5):
        data.qpos[0] = place
        mujoco.mj_forward(model, data)
        assert_same_capsules(model, data)


@pytest.mark.parametrize("case", ROPES)
def test_ropes_hang_as_in_mujocos_visualizer(case: str) -> None:
    keys = {"gravity": "0 0 -9.81", "place": ".5 .3 1.2", "how": LIMIT, "more": ""} | ROPES[case]
    model = mujoco.MjModel.from_xml_string(HANGING.format(**keys))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert_same_capsules(model, data)


def test_tendons_are_capsules_of_the_world_that_move() -> None:
    model = mujoco.MjModel.from_xml_string(WRAPPED)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    scene = raycam.from_mujoco(model, data)
    assert [item.name for item in scene.world.objects] == ["drum", "geom1", "rope"]
    for height in (0.0, -0.4, 0.5):
        data.qpos[0] = height
        mujoco.mj_forward(model, data)
        scene.update(data)
        for start, end, radius in drawn_capsules(model, data):
            middle = (start + end) / 2
            side = np.cross(end - start, [0.3, 0.5, 0.8])
            side /= np.linalg.norm(side)
            hit = scene.world.cast_rays(middle + 0.05 * side, -side, t_max=0.05, objects=["rope"])
            assert hit["t"] == pytest.approx(0.05 - radius, abs=0.03 * radius)  # the rope has 16 sides
    assert [item.name for item in raycam.from_mujoco(model, data, tendons=()).world.objects] == [
        "drum",
        "geom1",
    ]


def test_renderer_shows_the_tendons_of_the_selected_groups() -> None:
    model = mujoco.MjModel.from_xml_string(WRAPPED)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = Renderer(model, 60, 80)
    renderer.enable_segmentation_rendering()
    shown = mujoco.MjvOption()
    hidden, switched_off = mujoco.MjvOption(), mujoco.MjvOption()
    hidden.tendongroup[0] = 0
    switched_off.flags[mujoco.mjtVisFlag.mjVIS_TENDON] = 0
    for option, count in ((None, 1), (shown, 1), (hidden, 0), (switched_off, 0)):
        renderer.update_scene(data, scene_option=option)
        kinds = renderer.render().reshape(-1, 2)
        tendons = kinds[kinds[:, 1] == mujoco.mjtObj.mjOBJ_TENDON]
        assert set(tendons[:, 0]) == set(range(count))
