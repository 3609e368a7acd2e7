"""Lights of a model and of an `mjvScene`, in MuJoCo's own light."""

from __future__ import annotations

import dataclasses
import warnings

import mujoco
import numpy as np
import pytest
import raycam
from raycam.compat.mujoco import Renderer
from raycam.interop.mujoco.light_model import model_lights, scene_lights
from support.raises import warns

MODEL = """<mujoco><visual><headlight diffuse=".2 .2 .2" ambient="0 0 0"/></visual><worldbody>
  <light name="spot" pos="0 -1 4" dir="0 .2 -1" diffuse=".7 .6 .5" cutoff="60" exponent="1" attenuation="1 .05 0"/>
  <light name="sun" type="directional" dir="0 1 -1" castshadow="false"/>
  <geom name="floor" type="plane" size="3 3 1"/>
  <camera name="top" pos="0 0 5" xyaxes="1 0 0 0 1 0"/></worldbody></mujoco>"""


@pytest.fixture
def renderer() -> Renderer:
    """A renderer of a floor, seen from above."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = Renderer(model, 40, 40)
    found.update_scene(data, "top")
    found.data = data  # type: ignore[attr-defined]
    return found


def test_lights_of_an_unchanged_scene_equal_the_models_lights(renderer: Renderer) -> None:
    camera = renderer._view
    assert camera is not None
    expected = model_lights(renderer.model, renderer.data).seen_from(camera)  # type: ignore[attr-defined]
    found = scene_lights(renderer.scene.lights[: renderer.scene.nlight]).seen_from(camera)
    assert len(found) == len(expected) == 3
    for one, other in zip(found, expected, strict=True):
        is_spot = one.kind == mujoco.mjtLightType.mjLIGHT_SPOT
        for field in dataclasses.fields(one):
            if not is_spot and field.name in ("position", "cutoff", "exponent"):
                continue  # directional light does not depend on these values
            np.testing.assert_allclose(getattr(one, field.name), getattr(other, field.name), atol=1e-6)


def test_added_light_illuminates_its_cone(renderer: Renderer) -> None:
    plain = renderer.render().astype(int)
    light = renderer.scene.lights[renderer.scene.nlight]
    light.type, light.pos, light.dir = mujoco.mjtLightType.mjLIGHT_SPOT, [1, 1, 2], [0, 0, -1]
    light.diffuse, light.ambient, light.specular = [0.5, 0, 0], [0, 0, 0], [0, 0, 0]
    light.attenuation, light.cutoff, light.exponent, light.headlight = [1, 0, 0], 15, 0, 0
    renderer.scene.nlight += 1
    brighter = renderer.render() - plain
    # Pixels at the edge of the cone get more samples, which changes their other channels by less than 3 of 255.
    assert abs(brighter[..., 1:]).max() < 3
    rows, columns = np.nonzero(brighter[..., 0] > 10)
    # The cone's radius on the floor is 2 m * tan(15 degrees); the camera shows 2 * 5 m * tan(22.5 degrees).
    scale = 40 / (10 * np.tan(np.radians(22.5)))
    np.testing.assert_allclose([columns.mean() + 0.5, rows.mean() + 0.5], [20 + scale, 20 - scale], atol=0.3)
    area = np.pi * (scale * 2 * np.tan(np.radians(15))) ** 2
    assert len(rows) == pytest.approx(area, rel=0.3)


def test_removed_and_changed_lights_darken_the_image_until_the_next_update(renderer: Renderer) -> None:
    plain = renderer.render()
    renderer.scene.nlight = 0
    assert (renderer.render().max(axis=2) < plain.max(axis=2)).all()
    renderer.update_scene(renderer.data, "top")  # type: ignore[attr-defined]
    assert (renderer.render() == plain).all()
    for light in renderer.scene.lights[: renderer.scene.nlight]:
        if light.headlight:
            light.diffuse = [0, 0, 0]
    assert (renderer.render() <= plain).all()
    assert (renderer.render() != plain).any()


def test_changed_lights_give_a_notice_in_physically_based_looks(renderer: Renderer) -> None:
    renderer.look = "direct"
    renderer.scene.nlight = 1
    with warns(raycam.Notice, code="ignored_element", mentions=["lights", "direct"]):
        renderer.render()


def test_lights_that_change_in_the_model_are_used_after_the_next_update(renderer: Renderer) -> None:
    plain = renderer.render()
    renderer.model.light("sun").diffuse = [0, 0, 0]
    with warnings.catch_warnings():
        warnings.simplefilter("error", raycam.Notice)
        renderer.update_scene(renderer.data, "top")  # type: ignore[attr-defined]
    assert (renderer.render().max(axis=2) < plain.max(axis=2)).all()
