"""Worlds from MuJoCo's models, compared with MuJoCo's own rays."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
import raycam
from support.raises import raises, warns

FLAT = """<mujoco>
  <asset>
    <mesh name="tetra" vertex="0 0 0  0.5 0 0  0 0.5 0  0 0 0.6"/>
    <hfield name="field" nrow="3" ncol="4" size="0.6 0.4 0.3 0.1" elevation="0 1 0 1 1 0 1 0 0 0 1 1"/>
    <material name="blue" rgba="0 0 1 1"/>
  </asset>
  <worldbody>
    <light type="directional" dir="0 0 -1"/>
    <geom name="floor" type="plane" size="3 3 1" material="blue"/>
    <body name="arm" pos="0 0 0.5"><joint name="j" axis="0 1 0"/>
      <geom name="box" type="box" size="0.2 0.1 0.4" rgba="1 0 0 1" euler="10 20 30"/>
      <geom name="tetra" type="mesh" mesh="tetra" pos="0.5 0.2 0.3"/>
      <camera name="wrist" pos="0 0 1.5" fovy="50" resolution="40 30"/>
    </body>
    <geom name="field" type="hfield" hfield="field" pos="-1 1 0.1"/>
    <geom name="hidden" type="box" size="1 1 1" pos="0 0 3" group="3"/>
    <geom name="clear" type="box" size="1 1 1" pos="0 0 3" rgba="1 1 1 0"/>
    <camera name="side" pos="0 -4 2" xyaxes="1 0 0 0 0.4 1" fovy="45" resolution="60 40"/>
    <camera name="lens" pos="0 -4 2" xyaxes="1 0 0 0 0.4 1" resolution="60 40" sensorsize="0.006 0.004"
      focal="0.005 0.006" principal="0.0005 0.0002"/>
  </worldbody>
</mujoco>"""
ROUND = """<mujoco><worldbody>
  <geom name="s" type="sphere" size="0.3"/>
  <geom name="c" type="capsule" size="0.2 0.4" pos="1 0 0" euler="30 0 0"/>
  <geom name="y" type="cylinder" size="0.2 0.4" pos="2 0 0" euler="60 10 0"/>
  <geom name="e" type="ellipsoid" size="0.2 0.3 0.4" pos="3 0 0" euler="0 30 0"/>
  <camera name="a" pos="1.5 -4 1" xyaxes="1 0 0 0 0.2 1" fovy="45" resolution="80 40"/>
</worldbody></mujoco>"""


def judge(scene: Any, data: Any, camera: raycam.Camera) -> tuple[np.ndarray, np.ndarray]:
    """Distance and geom id of MuJoCo's ray through each pixel centre; -1 for a miss."""
    width, height = camera.size
    v, u = np.mgrid[:height, :width] + 0.5
    origins, directions = camera.rays(np.stack([u.ravel(), v.ravel()], axis=1))
    group, found = np.array([1, 1, 1, 0, 0, 0], np.uint8), []
    for origin, direction in zip(origins, directions, strict=True):
        geom = np.array([-1], np.int32)
        unit = direction / np.linalg.norm(direction)
        result = mujoco.mj_ray(scene.model, data, origin, unit, group, 1, -1, geom, np.zeros(3))
        found.append((result, geom[0]))
    distances, geoms = np.array(found).T
    return distances.reshape(height, width), geoms.astype(int).reshape(height, width)


def compare(model: Any, data: Any, scene: Any, name: str, tolerance: float) -> None:
    camera = scene.world.camera(name)
    frame = raycam.render(scene.world, camera, channels=["distance", "instance"])
    distances, geoms = judge(scene, data, camera)
    shown = np.array([*(geom for _, geom in scene.elements), -1])[frame["instance"]]
    same = shown == geoms
    assert same.mean() > 0.995
    hit = same & (geoms >= 0)
    assert hit.any()
    np.testing.assert_allclose(frame["distance"][hit], distances[hit], rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", ["side", "wrist", "lens"])
def test_distances_and_ids_agree_with_mujoco_rays_in_every_state(name: str) -> None:
    model = mujoco.MjModel.from_xml_string(FLAT)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    scene = raycam.from_mujoco(model)
    for angle in (0.0, 0.7, -0.4):
        data.qpos[0] = angle
        mujoco.mj_forward(model, data)
        scene.update(data)
        compare(model, data, scene, name, 1e-6)


def test_round_shapes_agree_within_their_tessellation() -> None:
    model = mujoco.MjModel.from_xml_string(ROUND)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    scene = raycam.from_mujoco(model, data)
    camera = scene.world.camera("a")
    frame = raycam.render(scene.world, camera, channels=["distance", "instance"])
    distances, geoms = judge(scene, data, camera)
    hit = (np.array([*(geom for _, geom in scene.elements), -1])[frame["instance"]] == geoms) & (geoms >= 0)
    assert np.median(abs(frame["distance"][hit] - distances[hit])) < 1e-3
    assert hit.sum() > 0.9 * (geoms >= 0).sum()


def test_camera_with_sensorsize_has_focal_lengths_in_pixels() -> None:
    scene = raycam.from_mujoco(mujoco.MjModel.from_xml_string(FLAT))
    np.testing.assert_allclose(scene.world.camera("lens").K[[0, 1], [0, 1]], [50, 60], rtol=1e-6)
    assert scene.world.camera("wrist").size == (40, 30)


def test_objects_have_names_categories_and_colours() -> None:
    scene = raycam.from_mujoco(mujoco.MjModel.from_xml_string(FLAT))
    names = {item.name: item.category for item in scene.world.objects}
    assert names == {"floor": "world", "box": "arm", "tetra": "arm", "field": "world"}
    colors = scene.world.triangle_colors()
    np.testing.assert_allclose(colors[0], [0, 0, 1], atol=1e-6)


def test_wrong_types_and_data_of_another_model_raise() -> None:
    with raises(raycam.WorldError, code="wrong_type", mentions=["mujoco.MjModel"]):
        raycam.from_mujoco({})
    scene = raycam.from_mujoco(mujoco.MjModel.from_xml_string(FLAT))
    with raises(raycam.WorldError, code="wrong_type", mentions=["mujoco.MjData"]):
        scene.update(3)
    other = mujoco.MjData(mujoco.MjModel.from_xml_string(ROUND))
    with raises(raycam.WorldError, code="wrong_shape", mentions=["4", "6"]):
        scene.update(other)


def test_data_without_poses_raises() -> None:
    model = mujoco.MjModel.from_xml_string(FLAT)
    with raises(raycam.WorldError, code="no_poses", mentions=["mj_forward"]):
        raycam.from_mujoco(model, mujoco.MjData(model))


def test_spot_lights_become_lights_of_the_world_that_move() -> None:
    model = mujoco.MjModel.from_xml_string("""<mujoco><statistic center="0 0 0" extent="2"/><worldbody>
      <body pos="0 0 2"><joint type="slide" axis="1 0 0"/><geom size=".1"/>
        <light pos="0 0 0" dir="0 0 -1" diffuse=".5 .5 .5" cutoff="30" exponent="0"/></body>
      <geom type="plane" size="2 2 1" rgba="1 1 1 1"/></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with warns(raycam.Notice, code="approximated_value", mentions=["light0"]):
        scene = raycam.from_mujoco(model, data)
    light = scene.world.lights[0]
    assert light["type"] == "spot"
    # The irradiance at the centre is pi / 2.
    np.testing.assert_allclose(light["intensity"], [np.pi * 0.5 * 4] * 3)
    data.qpos[0] = 0.25
    mujoco.mj_forward(model, data)
    scene.update(data)
    np.testing.assert_allclose(scene.world.lights[0]["position"], [0.25, 0, 2])


def test_sites_are_added_on_request() -> None:
    site = '<site name="tip" type="box" size=".1 .2 .3" pos="1 0 0"/>'
    model = mujoco.MjModel.from_xml_string(f'<mujoco><worldbody><geom size=".1"/>{site}</worldbody></mujoco>')
    assert [item.name for item in raycam.from_mujoco(model).world.objects] == ["geom0"]
    scene = raycam.from_mujoco(model, sites=(0,))
    assert [item.name for item in scene.world.objects] == ["geom0", "tip"]
    assert scene.elements[1] == (int(mujoco.mjtObj.mjOBJ_SITE), 0)
    np.testing.assert_allclose(scene.world.triangles(1).reshape(-1, 3).max(axis=0), [1.1, 0.2, 0.3])


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ({"groups": 1}, "wrong_type"),
        ({"sites": [6]}, "out_of_range"),
        ({"tendons": ["a"]}, "wrong_type"),
        ({"dynamic_alpha": "half"}, "wrong_type"),
        ({"dynamic_alpha": 1.5}, "out_of_range"),
    ],
)
def test_invalid_groups_and_opacities_are_refused(arguments: dict[str, Any], code: str) -> None:
    model = mujoco.MjModel.from_xml_string(FLAT)
    with raises(raycam.WorldError, code=code, mentions=arguments):
        raycam.from_mujoco(model, **arguments)


class OldModel:
    """The arrays of a model of MuJoCo 3.3.2.

    It has `light_directional` instead of `light_type`.
    """

    def __init__(self, model: Any) -> None:
        self._model = model

    def __getattr__(self, name: str) -> Any:
        if name in ("light_type", "tex_colorspace"):
            raise AttributeError(name)
        return getattr(self._model, name)


def test_models_of_older_versions_are_refused_with_both_versions() -> None:
    model = mujoco.MjModel.from_xml_string(FLAT)
    facts = [mujoco.__version__, "3.3.3", "light_type"]
    with raises(raycam.WorldError, code="unsupported_version", mentions=facts):
        raycam.from_mujoco(OldModel(model))
    with raises(raycam.WorldError, code="wrong_type", mentions=["MjData"]):
        raycam.from_mujoco(mujoco.MjData(model))
