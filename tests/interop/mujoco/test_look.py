"""Images with MuJoCo's own light and texture mappings.

They are compared with images of MuJoCo's renderer on OSMesa.
"""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.compat.mujoco import Renderer
from support.mujoco_scenes import REFERENCES, SCENES, add_markers, load, set_flags
from support.raises import raises, warns

pytestmark = pytest.mark.filterwarnings("ignore::raycam.Notice")


@pytest.mark.parametrize("name", sorted(SCENES))
def test_images_resemble_those_of_mujocos_renderer(name: str) -> None:
    model, data = load(name)
    renderer = Renderer(model, 120, 160)
    set_flags(renderer, name)
    renderer.update_scene(data, "main")
    add_markers(renderer.scene, name)
    expected = np.array(Image.open(REFERENCES / f"{name}.png")).astype(int)
    difference = abs(renderer.render().astype(int) - expected)
    assert np.median(difference) == 0
    assert difference.mean() < 1
    assert (difference.max(axis=2) > 12).mean() < 0.04  # only pixels at edges and highlights differ more


def test_look_selects_physically_based_light() -> None:
    model, data = load("lit")
    renderer = Renderer(model, 30, 40)
    renderer.update_scene(data, "main")
    own = renderer.render()
    renderer.look = "direct"
    assert abs(renderer.render().astype(int) - own).mean() > 5


def test_shadows_follow_the_state() -> None:
    model = mujoco.MjModel.from_xml_string("""<mujoco><visual><headlight active="0"/></visual><worldbody>
      <light type="directional" dir="0 1 -1" diffuse="1 1 1" specular="0 0 0"/>
      <geom type="plane" size="2 2 1" rgba="1 1 1 1"/>
      <body pos="0 0 1"><joint type="slide" axis="1 0 0"/><geom type="box" size=".2 .2 .2"/></body>
      <camera name="top" pos="0 0 4" resolution="41 41" fovy="60"/></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    scene = raycam.from_mujoco(model, data)
    camera = scene.world.camera("top")
    for place in (-0.7, 0.7):
        data.qpos[0] = place
        mujoco.mj_forward(model, data)
        scene.update(data)
        image = scene.render(camera, samples=1)
        points, _ = camera.project([[place, 1.0, 0.0], [-place, 1.0, 0.0]])
        shadow, lit = (int(image[int(v - camera.corner), int(u - camera.corner), 0]) for u, v in points)
        assert (shadow, lit) == (0, 180)  # 180 is 255 cos 45 degrees


def test_more_samples_smooth_edges() -> None:
    model, data = load("lit")
    scene = raycam.from_mujoco(model, data)
    camera = scene.world.camera("main")
    plain, smooth = (scene.render(camera, samples=samples).astype(int) for samples in (1, 4))
    changed = (plain != smooth).any(axis=2).mean()
    assert 0.01 < changed < 0.4


def test_geoms_covered_by_identical_later_geoms_are_omitted_with_a_notice() -> None:
    box = '<geom name="{}" type="box" size=".3 .2 .1" rgba="{} 1"/>'
    shapes = (
        box.format("lower", "1 0 0")
        + box.format("upper", "0 1 0")
        + '<geom name="other" size=".4" pos="2 0 0"/>'
    )
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{shapes}</worldbody></mujoco>")
    with warns(raycam.Notice, code="ignored_element", mentions=["'lower'"]):
        scene = raycam.from_mujoco(model)
    assert [item.name for item in scene.world.objects] == ["upper", "other"]
    renderer = Renderer(model, 60, 80)
    renderer.enable_segmentation_rendering()
    renderer.update_scene(forward(model))
    assert set(np.unique(renderer.render()[..., 0])) == {-1, 1, 2}


def test_geoms_covered_by_a_copy_of_their_mesh_are_omitted() -> None:
    points = 'vertex="0 0 0  1 0 0  0 1 0  0 0 1"'
    meshes = f'<mesh name="a" {points}/><mesh name="b" {points}/><mesh name="c" vertex="0 0 0  1 0 0  0 1 0  0 0 2"/>'
    geoms = "".join(f'<geom name="{name}" type="mesh" mesh="{name}"/>' for name in "abc")
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><asset>{meshes}</asset><worldbody>{geoms}</worldbody></mujoco>"
    )
    assert [item.name for item in raycam.from_mujoco(model).world.objects] == ["b", "c"]


def forward(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


@pytest.mark.parametrize("flag", ["mjRND_WIREFRAME", "mjRND_ADDITIVE"])
def test_flags_without_support_raise(flag: str) -> None:
    model, data = load("layered")
    renderer = Renderer(model, 30, 40)
    renderer.scene.flags[getattr(mujoco.mjtRndFlag, flag)] = 1
    renderer.update_scene(data, "main")
    with raises(raycam.SettingsError, code="unsupported_feature", mentions=[flag]):
        renderer.render()
