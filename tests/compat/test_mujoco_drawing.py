"""The stand-ins for MuJoCo's drawing functions, called as in dm_control, Gymnasium and robosuite."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest
import raycam
from raycam.compat import mujoco as stand_in
from support.raises import raises, warns

MODEL = """<mujoco>
  <statistic center="0 0 0.5" extent="2"/>
  <visual><quality offsamples="0"/></visual>
  <asset><texture name="grey" type="2d" builtin="flat" width="8" height="8" rgb1="0.5 0.5 0.5"/>
    <material name="grey" texture="grey"/></asset>
  <worldbody><light type="directional" dir="0 1 -1"/>
    <geom name="floor" type="plane" size="2 2 1" material="grey"/>
    <body pos="0 0 0.5"><joint type="slide" axis="1 0 0"/>
      <geom name="box" type="box" size="0.3 0.2 0.4" euler="10 20 30" rgba="1 0 0 1"/></body>
    <camera name="front" pos="0 -4 1.5" xyaxes="1 0 0 0 0.25 1" fovy="40"/>
  </worldbody></mujoco>"""
SIZE = 32, 24
SEGMENT, IDCOLOR, WIREFRAME = (
    mujoco.mjtRndFlag.__members__[f"mjRND_{name}"].value for name in ("SEGMENT", "IDCOLOR", "WIREFRAME")
)


@pytest.fixture(autouse=True)
def installed() -> Iterator[None]:
    stand_in.install()
    yield
    stand_in.uninstall()


class Program:
    """A program that draws an `mjvScene` into a buffer, as Gymnasium's `OffScreenViewer` does."""

    def __init__(self) -> None:
        self.model = mujoco.MjModel.from_xml_string(MODEL)
        self.data = mujoco.MjData(self.model)
        self.forward(0.3)
        self.scene = mujoco.MjvScene(self.model, 100)
        self.context = mujoco.MjrContext(self.model, mujoco.mjtFontScale.mjFONTSCALE_150)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self.context)

    def forward(self, place: float) -> None:
        self.data.qpos[0] = place
        mujoco.mj_forward(self.model, self.data)

    def update(self, camera: int = 0) -> None:
        view, option, perturbation = mujoco.MjvCamera(), mujoco.MjvOption(), mujoco.MjvPerturb()
        mujoco.mjv_defaultFreeCamera(self.model, view)
        if camera >= 0:
            view.type, view.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, camera
        category = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self.model, self.data, option, perturbation, view, category, self.scene)

    def draw(self, left: int = 0, width: int = SIZE[0]) -> None:
        mujoco.mjr_render(mujoco.MjrRect(left, 0, width, SIZE[1]), self.scene, self.context)

    def read(self, width: int = SIZE[0]) -> tuple[np.ndarray, np.ndarray]:
        """The colours and the depth buffer, beginning with the top row."""
        rgb, depth = np.zeros(3 * width * SIZE[1], np.uint8), np.zeros(width * SIZE[1], np.float32)
        mujoco.mjr_readPixels(rgb, depth, mujoco.MjrRect(0, 0, width, SIZE[1]), self.context)
        return rgb.reshape(SIZE[1], width, 3)[::-1], depth.reshape(SIZE[1], width)[::-1]

    def wanted(self, mode: str, camera: int = 0) -> np.ndarray:
        """An image of `mujoco.Renderer`'s stand-in."""
        renderer = stand_in.Renderer(self.model, SIZE[1], SIZE[0])
        if mode != "color":
            getattr(renderer, f"enable_{mode}_rendering")()
        renderer.update_scene(self.data, camera)
        return renderer.render()


@pytest.fixture
def program() -> Program:
    return Program()


@pytest.mark.parametrize("camera", [0, -1])
def test_pixels_equal_those_of_the_renderer(program: Program, camera: int) -> None:
    program.update(camera)
    program.draw()
    rgb, buffer = program.read()
    difference = abs(rgb.astype(int) - program.wanted("color", camera)).max(axis=2)
    assert (difference > 1).mean() < 0.01  # the camera of the scene is rounded to float32
    assert rgb.std() > 20
    near, far = (share * program.model.stat.extent for share in (0.01, 50.0))
    np.testing.assert_allclose(
        near / (1 - buffer * (1 - near / far)), program.wanted("depth", camera), rtol=3e-4
    )


def test_reversed_depth_map_is_zero_at_the_far_plane(program: Program) -> None:
    program.update()
    program.draw()
    straight = program.read()[1]
    program.context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
    reversed_ = program.read()[1]
    assert (straight.max(), reversed_.min()) == (1, 0)
    np.testing.assert_allclose(straight + reversed_, 1, atol=1e-6)


def test_segments_are_numbered_by_the_colours(program: Program) -> None:
    program.update()
    program.scene.flags[[SEGMENT, IDCOLOR]] = 1
    program.draw()
    program.scene.flags[[SEGMENT, IDCOLOR]] = 0
    numbers = program.read()[0].astype(int) @ [1, 256, 65536]
    ids = np.full((program.scene.ngeom + 1, 2), -1)
    for geom in program.scene.geoms[: program.scene.ngeom]:
        ids[geom.segid + 1] = geom.objid, geom.objtype
    np.testing.assert_array_equal(ids[numbers], program.wanted("segmentation"))
    program.scene.flags[SEGMENT] = 1
    program.draw()
    assert len(np.unique(program.read()[0].reshape(-1, 3), axis=0)) == 3  # background, floor and box


def test_image_shows_the_state_of_the_last_update(program: Program) -> None:
    program.update()
    program.draw()
    first = program.wanted("segmentation")
    program.forward(-0.5)
    rgb = program.read()[0]
    is_box = (rgb[..., 0] > 2 * rgb[..., 1].astype(int)) & (rgb[..., 0] > 60)
    assert (is_box == (first[..., 0] == 1)).mean() > 0.99


def test_viewports_lie_side_by_side(program: Program) -> None:
    left = Program()
    for each in (left, program):
        each.update()
        each.draw()
    program.forward(-0.5)
    program.update(-1)
    program.draw(left=SIZE[0])
    rgb, depth = program.read(2 * SIZE[0])
    np.testing.assert_array_equal(rgb[:, : SIZE[0]], left.read()[0])
    np.testing.assert_array_equal(depth[:, : SIZE[0]], left.read()[1])
    assert abs(rgb[:, SIZE[0] :].astype(int) - program.wanted("color", -1)).mean() < 1


def test_later_images_replace_earlier_ones(program: Program) -> None:
    program.update()
    for place in range(3):
        program.forward(0.1 * place)
        program.update()
        program.draw()
    assert len(program.context.images) == 1
    program.context.free()
    rgb, depth = program.read()
    assert (rgb.max(), depth.min()) == (0, 1)


def test_uploaded_textures_appear_in_the_next_image(program: Program) -> None:
    for value in (255, 0):
        program.model.tex_data[:] = value
        mujoco.mjr_uploadTexture(program.model, program.context, 0)
        program.update()
        program.draw()
        assert (program.read()[0][-1].max() > 60) == (value == 255)


def test_markers_of_the_program_are_shown(program: Program) -> None:
    program.update()
    program.draw()
    before = program.read()[0]
    marker = program.scene.geoms[program.scene.ngeom]
    mujoco.mjv_initGeom(
        marker,
        mujoco.mjtGeom.mjGEOM_SPHERE,
        np.full(3, 0.2),
        np.array([-0.7, 0, 1]),
        np.eye(3).ravel(),
        np.array([0, 1, 0, 1], np.float32),
    )
    program.scene.ngeom += 1
    program.draw()
    green = program.read()[0].astype(int) - before
    assert green[..., 1].max() > 30


def test_scenes_without_update_or_poses_are_empty_with_a_notice(program: Program) -> None:
    with warns(raycam.Notice, code="missing_value", mentions=["mjv_updateScene"]):
        program.draw()
    program.data = mujoco.MjData(program.model)
    with warns(raycam.Notice, code="no_poses", mentions=["mj_forward"]):
        program.update()
    program.draw()
    rgb, depth = program.read()
    assert (rgb.max(), depth.min()) == (0, 1)


def test_texts_give_a_notice_and_copies_of_pixels_raise(program: Program) -> None:
    viewport = mujoco.MjrRect(0, 0, *SIZE)
    with warns(raycam.Notice, code="ignored_element", mentions=["mjr_overlay"]):
        mujoco.mjr_overlay(
            mujoco.mjtFont.mjFONT_NORMAL,
            mujoco.mjtGridPos.mjGRID_TOPLEFT,
            viewport,
            "a",
            "b",
            program.context,
        )
    with raises(raycam.SettingsError, code="unsupported_feature", mentions=["mjr_drawPixels"]):
        mujoco.mjr_drawPixels(np.zeros((2, 2, 3), np.uint8), None, viewport, program.context)


def test_wireframes_raise(program: Program) -> None:
    program.update()
    program.scene.flags[WIREFRAME] = 1
    program.draw()
    with raises(raycam.SettingsError, code="unsupported_feature", mentions=["mjRND_WIREFRAME"]):
        program.read()


def test_arrays_of_another_size_raise(program: Program) -> None:
    program.update()
    program.draw()
    with raises(raycam.SettingsError, code="wrong_shape", mentions=["depth", "768", "[5]"]):
        mujoco.mjr_readPixels(None, np.zeros(5, np.float32), mujoco.MjrRect(0, 0, *SIZE), program.context)


def test_buffer_has_the_models_size_until_it_is_resized(program: Program) -> None:
    largest = mujoco.mjr_maxViewport(program.context)
    assert (largest.width, largest.height) == (
        program.model.vis.global_.offwidth,
        program.model.vis.global_.offheight,
    )
    mujoco.mjr_resizeOffscreen(50, 40, program.context)
    assert mujoco.mjr_maxViewport(program.context).width == 50


def test_opengl_contexts_are_replaced_and_restored() -> None:
    for name in ("egl", "glfw", "osmesa"):
        context = importlib.import_module(f"mujoco.{name}").GLContext(640, 480)
        context.make_current()
        context.free()
    stand_in.uninstall()
    assert mujoco.mjr_render.__module__ == "mujoco._render"
    assert "mujoco.osmesa" not in sys.modules
    assert mujoco.Renderer is not stand_in.Renderer


def test_contexts_of_dm_control_are_replaced(
    program: Program, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "dm_control" / "mujoco").mkdir(parents=True)
    (tmp_path / "dm_control" / "__init__.py").touch()
    (tmp_path / "dm_control" / "mujoco" / "__init__.py").touch()
    (tmp_path / "dm_control" / "mujoco" / "engine.py").write_text(
        "import collections\n"
        "Contexts = collections.namedtuple('Contexts', ['gl', 'mujoco'])\n"
        "class Physics:\n"
        "  @property\n"
        "  def contexts(self): raise RuntimeError('No OpenGL rendering backend is available.')\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    stand_in.uninstall()
    stand_in.install()
    try:
        engine = importlib.import_module("dm_control.mujoco.engine")
        physics = engine.Physics()
        physics.model = type("Model", (), {"ptr": program.model})()
        program.update()
        rgb = np.zeros((*SIZE[::-1], 3), np.uint8)
        viewport = mujoco.MjrRect(0, 0, *SIZE)
        with physics.contexts.gl.make_current() as thread:
            thread.call(mujoco.mjr_render, viewport, program.scene, physics.contexts.mujoco.ptr)
            thread.call(mujoco.mjr_readPixels, rgb, None, viewport, physics.contexts.mujoco.ptr)
        program.draw()
        np.testing.assert_array_equal(physics.contexts.gl.to_pixels(rgb), program.read()[0])
        stand_in.uninstall()
        with pytest.raises(RuntimeError, match="OpenGL"):
            _ = physics.contexts
    finally:
        for name in [name for name in sys.modules if name.split(".")[0] == "dm_control"]:
            del sys.modules[name]
