"""The stand-in for `mujoco.Renderer`, compared with MuJoCo's rays."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import mujoco
import numpy as np
import pytest
import raycam
from raycam.compat import mujoco as stand_in
from support.raises import raises, warns

MODEL = """<mujoco>
  <statistic center="0 0 0.5" extent="2"/>
  <worldbody><light type="directional" dir="0 1 -1"/>
    <geom name="floor" type="plane" size="2 2 1" rgba="0 0 1 1"/>
    <body pos="0 0 0.5"><joint type="slide" axis="1 0 0"/>
      <geom name="box" type="box" size="0.3 0.2 0.4" euler="10 20 30" rgba="1 0 0 1"/></body>
    <geom name="extra" type="box" size="0.1 0.1 0.1" pos="1 0 0.5" group="4"/>
    <camera name="front" pos="0 -4 1.5" xyaxes="1 0 0 0 0.25 1" fovy="40"/>
  </worldbody></mujoco>"""


@pytest.fixture
def state() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    data.qpos[0] = 0.3
    mujoco.mj_forward(model, data)
    return model, data


@pytest.fixture
def installed() -> Iterator[None]:
    stand_in.install()
    yield
    stand_in.uninstall()


def expected(
    model: mujoco.MjModel, data: mujoco.MjData, fovy: float, pose: np.ndarray, size: tuple[int, int]
):
    """Depth and geom ids from `mj_ray`, with rays computed from the field of view."""
    width, height = size
    half = np.tan(np.radians(fovy) / 2)
    depth, ids = np.full((height, width), np.nan), np.full((height, width), -1)
    group = np.array([1, 1, 1, 0, 0, 0], np.uint8)
    for v in range(height):
        for u in range(width):
            local = np.array([(2 * u + 1 - width) / height * half, -(2 * v + 1 - height) / height * half, -1])
            geom = np.array([-1], np.int32)
            length = np.linalg.norm(local)
            ray = pose[:3, :3] @ local / length
            distance = mujoco.mj_ray(model, data, pose[:3, 3], ray, group, 1, -1, geom, np.zeros(3))
            if geom[0] >= 0:
                depth[v, u], ids[v, u] = distance / length, geom[0]
    return depth, ids


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize("camera", ["front", 0, -1])
def test_depth_and_segmentation_agree_with_mujoco_rays(
    state: tuple[mujoco.MjModel, mujoco.MjData], camera: str | int
) -> None:
    model, data = state
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = data.cam_xmat[0].reshape(3, 3), data.cam_xpos[0]
    fovy = 40.0
    if camera == -1:
        view = mujoco.MjvCamera()
        mujoco.mjv_defaultFreeCamera(model, view)
        turn, rise = np.radians([view.azimuth, view.elevation])
        forward = np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
        right = np.cross(forward, [0, 0, 1]) / np.linalg.norm(np.cross(forward, [0, 0, 1]))
        pose[:3, :3] = np.stack([right, np.cross(right, forward), -forward], axis=1)
        pose[:3, 3], fovy = view.lookat - view.distance * forward, float(model.vis.global_.fovy)
    with mujoco.Renderer(model, 30, 40) as renderer:
        assert (renderer.height, renderer.width) == (30, 40)
        renderer.enable_depth_rendering()
        renderer.update_scene(data, camera=camera)
        depth = renderer.render()
        renderer.disable_depth_rendering()
        renderer.enable_segmentation_rendering()
        segmentation = renderer.render()
        renderer.disable_segmentation_rendering()
        color = renderer.render()
    wanted, ids = expected(model, data, fovy, pose, (40, 30))
    assert (depth.dtype, segmentation.dtype, color.dtype) == (np.float32, np.int32, np.uint8)
    assert (depth.shape, segmentation.shape, color.shape) == ((30, 40), (30, 40, 2), (30, 40, 3))
    np.testing.assert_array_equal(segmentation[..., 0], ids)
    np.testing.assert_array_equal(segmentation[..., 1], np.where(ids >= 0, int(mujoco.mjtObj.mjOBJ_GEOM), -1))
    np.testing.assert_allclose(depth[ids >= 0], wanted[ids >= 0], rtol=0, atol=1e-6)
    np.testing.assert_allclose(depth[ids < 0], model.vis.map.zfar * model.stat.extent)
    box = color[ids == 2].mean(axis=0)
    assert box[0] > 2 * box[2]


def test_scene_options_without_effect_give_a_notice_with_their_names(
    state: tuple[mujoco.MjModel, mujoco.MjData],
) -> None:
    model, data = state
    option = mujoco.MjvOption()
    option.flags[mujoco.mjtVisFlag.mjVIS_CONVEXHULL] = True
    option.label = mujoco.mjtLabel.mjLABEL_GEOM
    with stand_in.Renderer(model) as renderer:
        with warns(raycam.Notice, code="ignored_element", mentions=["mjVIS_CONVEXHULL", "label"]):
            renderer.update_scene(data, "front", option)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            renderer.update_scene(data, "front", mujoco.MjvOption())


def test_scene_options_select_groups(state: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, data = state
    renderer = stand_in.Renderer(model, 30, 40)
    renderer.enable_segmentation_rendering()
    option = mujoco.MjvOption()
    option.geomgroup[4] = 1
    for scene_option, shown in ((None, False), (option, True)):
        renderer.update_scene(data, "front", scene_option)
        assert (renderer.render()[..., 0] == 1).any() == shown


def test_images_before_the_first_scene_are_empty_with_a_notice(
    state: tuple[mujoco.MjModel, mujoco.MjData],
) -> None:
    model, _ = state
    renderer = stand_in.Renderer(model, 30, 40)
    with warns(raycam.Notice, code="missing_value", mentions=["update_scene"]):
        color = renderer.render()
    with warns(raycam.Notice, code="no_poses", mentions=["mj_forward"]):
        renderer.update_scene(mujoco.MjData(model))
    renderer.enable_depth_rendering()
    with warns(raycam.Notice, code="missing_value", mentions=["update_scene"]):
        depth = renderer.render()
    renderer.enable_segmentation_rendering()
    with warns(raycam.Notice, code="missing_value", mentions=["update_scene"]):
        ids = renderer.render()
    assert (color.shape, color.dtype, color.max()) == ((30, 40, 3), np.uint8, 0)
    assert (depth.shape, depth.dtype, depth.min()) == ((30, 40), np.float32, 100)
    assert (ids.shape, ids.dtype, ids.max()) == ((30, 40, 2), np.int32, -1)


def test_empty_image_has_the_size_of_the_replaced_camera(
    state: tuple[mujoco.MjModel, mujoco.MjData],
) -> None:
    renderer = stand_in.Renderer(state[0], 30, 40)
    renderer.camera = raycam.Camera.look_at([0, -3, 1], [0, 0, 0.5], size=(20, 10), fov=50)
    with warns(raycam.Notice, code="missing_value"):
        assert renderer.render().shape == (10, 20, 3)


def test_update_scene_refuses_data_of_another_type(state: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    renderer = stand_in.Renderer(state[0], 30, 40)
    with raises(raycam.WorldError, code="wrong_type"):
        renderer.update_scene(5)


def test_scene_contains_the_camera_of_update_scene(state: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, data = state
    view = mujoco.MjvCamera()
    view.distance, view.azimuth, view.elevation = 3.0, 90.0, 0.0
    renderer = stand_in.Renderer(model, 30, 40)
    for camera, place in (("front", data.cam_xpos[0]), (0, data.cam_xpos[0]), (view, [0, -3, 0])):
        renderer.update_scene(data, camera)
        np.testing.assert_allclose(
            np.mean([eye.pos for eye in renderer.scene.camera], axis=0), place, atol=1e-6
        )


def test_colours_that_a_program_changes_in_the_model_appear_in_the_next_scene(
    state: tuple[mujoco.MjModel, mujoco.MjData],
) -> None:
    model, data = state
    renderer = stand_in.Renderer(model, 30, 40)
    for color in ([1, 0, 0, 1], [0, 1, 0, 1]):
        model.geom("box").rgba = color
        renderer.update_scene(data, "front")
        red, green, _ = renderer.render()[15, 22].astype(int)
        assert (red > 2 * green) == (color[0] == 1)


def test_bodies_are_blended_with_the_floor_if_the_option_makes_them_transparent(
    state: tuple[mujoco.MjModel, mujoco.MjData],
) -> None:
    model, data = state
    option = mujoco.MjvOption()
    option.flags[mujoco.mjtVisFlag.mjVIS_TRANSPARENT] = True
    renderer, images = stand_in.Renderer(model, 30, 40), []
    for transparent in (None, option):
        renderer.update_scene(data, "front", transparent)
        images.append(renderer.render().astype(float))
    renderer.scene.ngeom = 1  # the floor alone
    floor = renderer.render()[15, 22]
    opacity = 1 - (1 - float(model.vis.map.alpha)) ** 2  # the front and the back of the box
    blended = opacity * images[0][15, 22] + (1 - opacity) * floor
    np.testing.assert_allclose(images[1][15, 22], blended, atol=1.5)


def test_decorations_of_the_option_are_visible(state: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, data = state
    renderer = stand_in.Renderer(model, 60, 80)
    renderer.enable_segmentation_rendering()
    option = mujoco.MjvOption()
    option.flags[mujoco.mjtVisFlag.mjVIS_JOINT] = True
    model.vis.scale.jointlength = 5  # the joint's arrow is longer than the box
    for scene_option, is_shown in ((None, False), (option, True)):
        renderer.update_scene(data, "front", scene_option)
        types = np.unique(renderer.render()[..., 1])
        assert (int(mujoco.mjtObj.mjOBJ_JOINT) in types) == is_shown


def test_geoms_that_a_program_removes_or_replaces_in_the_scene_are_not_shown(
    state: tuple[mujoco.MjModel, mujoco.MjData],
) -> None:
    model, data = state
    renderer = stand_in.Renderer(model, 30, 40)
    renderer.enable_segmentation_rendering()
    box = model.geom("box").id
    renderer.update_scene(data, "front")
    assert (renderer.render()[..., 0] == box).any()
    number = next(i for i in range(renderer.scene.ngeom) if renderer.scene.geoms[i].objid == box)
    renderer.scene.geoms[number].pos = [0, 0, 50]
    assert not (renderer.render()[..., 0] == box).any()
    renderer.update_scene(data, "front")
    assert (renderer.render()[..., 0] == box).any()
    renderer.scene.ngeom = 0
    assert renderer.render().max() == -1


def test_renderer_uses_raycams_camera_and_output_array(state: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, data = state
    renderer = stand_in.Renderer(model, 30, 40)
    renderer.update_scene(data)
    renderer.camera = raycam.Camera.look_at([0, -3, 1], [0, 0, 0.5], size=(20, 10), fov=50)
    out = np.zeros((10, 20, 3), np.uint8)
    assert renderer.render(out=out) is out
    assert out.any()
    with raises(raycam.SettingsError, code="wrong_shape", mentions=["[10, 20, 3]", "[3, 3]"]):
        renderer.render(out=np.zeros((3, 3)))


@pytest.mark.parametrize(
    ("camera", "code"),
    [
        ("frnt", "unknown_name"),
        (1, "index_out_of_range"),
        (-2, "index_out_of_range"),
        (0.5, "index_out_of_range"),
    ],
)
def test_unknown_cameras_raise(
    state: tuple[mujoco.MjModel, mujoco.MjData], camera: object, code: str
) -> None:
    model, data = state
    with raises(raycam.SettingsError, code=code, mentions=["camera"]):
        stand_in.Renderer(model).update_scene(data, camera)


def test_lights_are_reported_as_approximated_only_in_physically_based_looks() -> None:
    model = mujoco.MjModel.from_xml_string(MODEL.replace('type="directional"', 'pos="0 0 3"'))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = stand_in.Renderer(model, 12, 16)
    with warnings.catch_warnings():
        warnings.simplefilter("error", raycam.Notice)
        renderer.update_scene(data)
        renderer.render()
    renderer = stand_in.Renderer(model, 12, 16)
    renderer.look = "direct"
    with warns(raycam.Notice, code="approximated_value", mentions=["light0"]):
        renderer.update_scene(data)


@pytest.mark.parametrize("mode", ["color", "depth", "segmentation"])
def test_further_channels_are_stored_in_the_frame(
    state: tuple[mujoco.MjModel, mujoco.MjData], mode: str
) -> None:
    renderer = stand_in.Renderer(state[0], 30, 40)
    if mode != "color":
        getattr(renderer, f"enable_{mode}_rendering")()
    renderer.update_scene(state[1], "front")
    plain = renderer.render()
    assert renderer.frame is None
    renderer.channels = ["normal", "distance"]
    np.testing.assert_array_equal(renderer.render(), plain)
    assert renderer.frame is not None
    assert (renderer.frame["normal"].shape, renderer.frame["distance"].shape) == ((30, 40, 3), (30, 40))
    np.testing.assert_allclose(renderer.frame["normal"][-1, 0], [0, 0, 1], atol=1e-6)
    renderer.channels = ["normals"]
    with raises(raycam.SettingsError, mentions=["normals"]):
        renderer.render()


def test_flags_of_segments_are_refused_by_the_renderer(state: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    renderer = stand_in.Renderer(state[0], 30, 40)
    renderer.update_scene(state[1], "front")
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = 1
    with raises(raycam.SettingsError, code="unsupported_feature", mentions=["mjRND_SEGMENT"]):
        renderer.render()
