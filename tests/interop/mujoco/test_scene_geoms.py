"""Geoms that are added to `renderer.scene`: closed forms for depth, ids and outlines.

`test_look.py` compares their colours with MuJoCo's renderer.
"""

from __future__ import annotations

import warnings

import mujoco
import numpy as np
import pytest
import raycam
from raycam.compat.mujoco import Renderer
from support.mujoco_scenes import add_geom
from support.raises import warns

MODEL = """<mujoco><statistic center="0 0 0" extent="4"/><worldbody>
  <geom name="wall" type="box" size="2 .1 2" pos="0 2.1 0"/>
  <camera name="front" pos="0 -4 0" xyaxes="1 0 0 0 0 1" fovy="40"/></worldbody></mujoco>"""
SIZE = 201
SCALE = SIZE / 2 / np.tan(np.radians(20)) / 4
"""Pixels per metre in the plane y = 0."""


@pytest.fixture
def renderer() -> Renderer:
    """A renderer of a wall at y = 2 m, with the camera at y = -4 m."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = Renderer(model, SIZE, SIZE)
    found.data = data  # type: ignore[attr-defined]
    found.update_scene(data, "front")
    return found


def mask(renderer: Renderer) -> np.ndarray:
    renderer.enable_depth_rendering()
    depth = renderer.render()
    renderer.disable_depth_rendering()
    return depth < 5


@pytest.mark.parametrize(
    ("kind", "size", "nearest"),
    [
        ("SPHERE", [0.3, 0.3, 0.3], 0.3),
        ("CAPSULE", [0.2, 0.2, 0.4], 0.2),
        ("ELLIPSOID", [0.1, 0.5, 0.2], 0.5),
        ("CYLINDER", [0.2, 0.2, 0.4], 0.2),
        ("BOX", [0.1, 0.25, 0.2], 0.25),
        ("ARROW2", [0.1, 0.1, 1.2], 0.1),
    ],
)
def test_depth_of_added_geom_is_distance_to_its_surface(
    renderer: Renderer, kind: str, size: list[float], nearest: float
) -> None:
    add_geom(renderer.scene, kind, size, [0, 0, 0])
    renderer.enable_depth_rendering()
    depth = renderer.render()
    np.testing.assert_allclose(depth[SIZE // 2, SIZE // 2], 4 - nearest, atol=1e-3)
    np.testing.assert_allclose(depth[30, 30], 6, atol=1e-5)


@pytest.mark.parametrize(
    ("kind", "bottom", "top", "widest"),
    [("ARROW", 0.0, 0.6, 0.35), ("ARROW1", 0.0, 0.6, 0.2), ("ARROW2", -0.6, 0.6, 0.35)],
)
def test_arrows_have_the_proportions_of_mjr_render(
    renderer: Renderer, kind: str, bottom: float, top: float, widest: float
) -> None:
    # `mjr_render`: the head is a third of the arrow, and its radius 1.75 times the shaft's.
    add_geom(renderer.scene, kind, [0.1, 0.1, 1.2], [0, 0, 0])
    shown = mask(renderer)
    rows = np.flatnonzero(shown.any(axis=1))
    np.testing.assert_allclose(
        (SIZE / 2 - np.array([rows[-1] + 1, rows[0]])) / SCALE, [bottom, top], atol=0.03
    )
    widths = shown.sum(axis=1) / SCALE
    np.testing.assert_allclose(widths.max(), widest, atol=0.03)
    np.testing.assert_allclose(widths[int(SIZE / 2 - 0.2 * SCALE)], 0.2, atol=0.03)


@pytest.mark.parametrize("width", [3, 9])
def test_lines_have_the_given_width_in_pixels_and_no_shading(renderer: Renderer, width: int) -> None:
    geom = add_geom(renderer.scene, "LINE", [0, 0, 0], [0, 0, 0], rgba=[0.2, 0.4, 0.6, 1])
    ends = np.array([-0.5, 0.5, 0.0]), np.array([0.5, 0.5, 0.0])
    mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_LINE, width, *ends)
    shown = mask(renderer)
    assert shown[:, SIZE // 2].sum() == width
    assert renderer.render()[SIZE // 2, SIZE // 2].tolist() == [51, 102, 153]


def test_decorations_cast_no_shadows(renderer: Renderer) -> None:
    # `renderGeom` of MuJoCo omits decorations, which `mjv_initGeom` creates, from the shadow map.
    light = mujoco.MjModel.from_xml_string(
        MODEL.replace("<worldbody>", '<worldbody><light pos="0 -4 3" dir="0 5 -3"/>')
    )
    data = mujoco.MjData(light)
    mujoco.mj_forward(light, data)
    images = []
    for category in (mujoco.mjtCatBit.mjCAT_DECOR, mujoco.mjtCatBit.mjCAT_DYNAMIC):
        shown = Renderer(light, SIZE, SIZE)
        shown.update_scene(data, "front")
        add_geom(shown.scene, "SPHERE", [0.2, 0.2, 0.2], [0, 1, 0]).category = category
        images.append(shown.render().astype(int))
    below = np.s_[SIZE // 2 + 20 : SIZE // 2 + 50, SIZE // 2]
    assert (images[0][below] > images[1][below] + 50).any()


def test_update_scene_removes_added_geoms(renderer: Renderer) -> None:
    assert renderer.scene.ngeom == 1
    add_geom(renderer.scene, "SPHERE", [0.3, 0.3, 0.3], [0, 0, 0])
    assert mask(renderer).any()
    renderer.update_scene(renderer.data, "front")  # type: ignore[attr-defined]
    assert renderer.scene.ngeom == 1
    assert not mask(renderer).any()


def test_transparent_geom_blends_with_what_is_behind_it(renderer: Renderer) -> None:
    plain = renderer.render()
    add_geom(renderer.scene, "BOX", [0.3, 0.01, 0.3], [0, 0, 0], rgba=[0, 0, 0, 0.25])
    middle = (SIZE // 2, SIZE // 2)
    np.testing.assert_allclose(renderer.render()[middle], plain[middle], atol=75)
    assert (renderer.render()[middle] < plain[middle]).all()


def test_segmentation_contains_type_and_id_that_the_program_set(renderer: Renderer) -> None:
    first = add_geom(renderer.scene, "SPHERE", [0.1, 0.1, 0.1], [0, 0, 0])
    second = add_geom(renderer.scene, "SPHERE", [0.1, 0.1, 0.1], [0.5, 0, 0])
    first.objtype, first.objid = mujoco.mjtObj.mjOBJ_GEOM, 70
    second.objtype, second.objid = mujoco.mjtObj.mjOBJ_SITE, 3
    renderer.enable_segmentation_rendering()
    found = {tuple(row) for row in renderer.render().reshape(-1, 2).tolist()}
    geom, site = int(mujoco.mjtObj.mjOBJ_GEOM), int(mujoco.mjtObj.mjOBJ_SITE)
    assert {(0, geom), (70, geom), (3, site)} <= found


@pytest.mark.parametrize("look", ["direct", "mujoco"])
def test_added_geoms_are_visible_in_every_look(renderer: Renderer, look: str) -> None:
    renderer.look = look  # type: ignore[assignment]
    before = renderer.render()
    add_geom(renderer.scene, "SPHERE", [0.3, 0.3, 0.3], [0, 0, 0], rgba=[0, 1, 0, 1])
    red, green, _ = renderer.render()[SIZE // 2, SIZE // 2].astype(int)
    assert green > 2 * red
    assert (before[SIZE // 2, SIZE // 2] != [red, green, 0]).any()


def test_unsupported_geom_types_and_labels_give_a_notice(renderer: Renderer) -> None:
    add_geom(renderer.scene, "LINEBOX", [0.3, 0.3, 0.3], [0, 0, 0])
    add_geom(renderer.scene, "SPHERE", [0.1, 0.1, 0.1], [0, 0, 0]).label = "a"
    with warns(raycam.Notice, code="ignored_element", mentions=["type 104", "labels"]):
        renderer.render()
    renderer.scene.ngeom -= 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        add_geom(renderer.scene, "SPHERE", [0.1, 0.1, 0.1], [0, 0, 0], rgba=[0, 0, 0, 0]).label = ""
        assert not mask(renderer).any()


@pytest.mark.parametrize(
    "kind", ["SPHERE", "CAPSULE", "CYLINDER", "ELLIPSOID", "BOX", "ARROW", "ARROW2", "LINE"]
)
def test_geoms_without_size_are_invisible(renderer: Renderer, kind: str) -> None:
    add_geom(renderer.scene, kind, [0, 0, 0], [0, 0, 0])
    assert mask(renderer).sum() <= 1


def test_changed_mesh_is_shown_as_in_the_model_with_a_notice() -> None:
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset><worldbody>
        <geom name="part" type="mesh" mesh="m"/><camera name="front" pos="0 -4 0" xyaxes="1 0 0 0 0 1"/>
        </worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = Renderer(model, SIZE, SIZE)
    renderer.update_scene(data, "front")
    before = mask(renderer)
    assert before.any()
    renderer.scene.geoms[0].pos = [0, 0, 50]
    with warns(raycam.Notice, code="ignored_element", mentions=["changes of geoms of type 7"]):
        after = mask(renderer)
    np.testing.assert_array_equal(after, before)


def test_added_geoms_have_the_mean_colour_of_their_texture_with_a_notice() -> None:
    model = mujoco.MjModel.from_xml_string(
        MODEL.replace(
            "<worldbody>",
            '<asset><texture name="t" type="2d" builtin="flat" rgb1=".2 .4 1" width="8" height="8"/>'
            '<material name="m" texture="t"/></asset><worldbody>',
        )
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = Renderer(model, 40, 40)
    images = []
    for material, rgba in ((-1, [0.2, 0.4, 1, 1]), (0, [1, 1, 1, 1])):
        renderer.update_scene(data, "front")
        add_geom(renderer.scene, "BOX", [1, 1, 1], [0, 0, 0])
        added = renderer.scene.geoms[renderer.scene.ngeom - 1]
        added.matid, added.rgba = material, rgba
        if material >= 0:
            with warns(raycam.Notice, code="ignored_element", mentions=["textures"]):
                images.append(renderer.render())
        else:
            images.append(renderer.render())
    assert abs(images[0].astype(int) - images[1]).max() <= 1
