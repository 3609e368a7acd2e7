"""Robots of MJCF files, compared with MuJoCo's kinematics and its rays."""

from __future__ import annotations

import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
import raycam
from raycam.cli import main
from support.raises import raises, warns

ARM = """<mujoco model="arm"><compiler angle="degree" meshdir="meshes"/>
  <asset><mesh name="tip" file="tip.stl"/><material name="red" rgba="1 0 0 1"/></asset>
  <worldbody><geom name="floor" type="plane" size="2 2 .1"/>
    <body name="base" pos="0 0 .3" euler="0 0 20"><freejoint name="float"/><geom size=".1"/>
      <body name="upper" pos=".1 0 .1" euler="10 20 30">
        <joint name="pitch" axis="0 1 .2" pos="0 .05 0" range="-90 90" ref="15"/>
        <joint name="slide" type="slide" axis="1 1 0" range="-.2 .2" ref=".05"/>
        <joint name="yaw" axis="0 0 1"/>
        <geom type="box" size=".2 .05 .05" pos=".2 0 0" material="red"/>
        <geom type="capsule" size=".06 .2" pos=".2 0 0" euler="0 90 0" group="3"/>
        <body pos=".4 0 0"><joint name="socket" type="ball" pos=".01 0 .02"/>
          <geom type="mesh" mesh="tip" euler="0 40 0"/>
          <camera name="wrist" pos="0 0 .1" euler="20 0 0" fovy="60" resolution="40 30"/>
          <body name="left"><joint name="finger" type="slide" axis="0 1 0" range="0 .1"/><geom size=".02"/></body>
          <body name="right"><joint name="other" type="slide" axis="0 1 0" range="-.1 0"/><geom size=".02"/></body>
        </body></body></body>
    <body name="plain" pos="1 0 0"><geom size=".1 .2" type="cylinder"/></body></worldbody>
  <equality><joint joint1="other" joint2="finger" polycoef="0 -1 0 0 0"/></equality></mujoco>"""
TIP = [
    [(0, 0, 0), (0, 0.1, 0), (0.1, 0, 0)],
    [(0, 0, 0), (0.1, 0, 0), (0, 0, 0.2)],
    [(0, 0, 0), (0, 0, 0.2), (0, 0.1, 0)],
    [(0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.2)],
]
pytestmark = pytest.mark.filterwarnings("ignore::raycam.Notice")


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    (tmp_path / "meshes").mkdir()
    solid = mesh_bytes()
    (tmp_path / "meshes/tip.stl").write_bytes(solid)
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    return path


def mesh_bytes() -> bytes:
    """A tetrahedron as binary STL, which MuJoCo requires."""
    corners = np.array(TIP, np.float32).reshape(-1, 9)
    records = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")])
    records["corners"] = corners
    return bytes(80) + np.uint32(len(corners)).tobytes() + records.tobytes()


def qpos(model: mujoco.MjModel, robot: raycam.Robot) -> np.ndarray:
    """MuJoCo's state for the robot's values: quaternions are w x y z, and mimic joints follow."""
    values = {}
    start = 0
    for name in robot.joints:
        # Free joints have 7 values, and ball joints 4.
        width = {0: 7, 1: 4}.get(int(model.joint(name).type[0]), 1)
        own = robot.values[start : start + width]
        if width > 1:
            own = np.concatenate([own[:-4], own[-1:], own[-4:-1]])
        values[name], start = own, start + width
    values["other"] = -values["finger"]
    return np.concatenate([values[model.joint(number).name] for number in range(model.njnt)])


def test_links_have_the_poses_of_mujocos_bodies(arm: Path) -> None:
    world = raycam.load(arm)
    robot = world.robots["arm"]
    assert robot.joints == ("float", "pitch", "slide", "yaw", "socket", "finger")
    assert robot.limits["pitch"] == pytest.approx((-np.pi / 2, np.pi / 2))
    assert robot.limits["yaw"] == (-np.inf, np.inf)
    model = mujoco.MjModel.from_xml_path(str(arm))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(4)
    for step in range(20):
        if step:
            values = rng.normal(size=len(robot.values))
            values[[3, 4, 5, 6]] /= np.linalg.norm(values[[3, 4, 5, 6]])
            world.set_joints("arm", values)
        data.qpos[:] = qpos(model, robot)
        if step == 0:
            np.testing.assert_allclose(data.qpos, model.qpos0, atol=1e-12)
        mujoco.mj_kinematics(model, data)
        for body in range(model.nbody):
            name = model.body(body).name or f"body{body}"
            pose = robot.pose(name)
            np.testing.assert_allclose(pose[:3, 3], data.xpos[body], rtol=0, atol=1e-12)
            np.testing.assert_allclose(pose[:3, :3], data.xmat[body].reshape(3, 3), rtol=0, atol=1e-12)


def test_jacobian_agrees_with_mujoco(arm: Path) -> None:
    world = raycam.load(arm)
    robot = world.robots["arm"]
    model = mujoco.MjModel.from_xml_path(str(arm))
    data = mujoco.MjData(model)
    values = np.random.default_rng(5).normal(size=len(robot.values))
    world.set_joints("arm", values)
    data.qpos[:] = qpos(model, robot)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    rows = np.zeros((6, model.nv))
    mujoco.mj_jacBody(model, data, rows[:3], rows[3:], model.body("right").id)
    found = robot.jacobian("right")
    scalar = [model.joint(name).dofadr[0] for name in ("pitch", "slide", "yaw")]
    np.testing.assert_allclose(found[:, 6:9], rows[:, scalar], rtol=0, atol=1e-9)
    fingers = [model.joint(name).dofadr[0] for name in ("finger", "other")]
    np.testing.assert_allclose(found[:, 12], rows[:, fingers] @ [1, -1], rtol=0, atol=1e-9)
    socket = model.joint("socket").dofadr[0]
    # MuJoCo's columns are rotations about the child's axes.
    child = data.xmat[model.body("left").parentid[0]].reshape(3, 3)
    parent = found[:, 9:12]
    link = robot.pose("upper")[:3, :3]
    np.testing.assert_allclose(parent @ link.T @ child, rows[:, socket : socket + 3], rtol=0, atol=1e-9)


def test_objects_and_cameras_match_mujoco_at_joint_values(arm: Path) -> None:
    world = raycam.load(arm)
    robot = world.robots["arm"]
    model = mujoco.MjModel.from_xml_path(str(arm))
    data = mujoco.MjData(model)
    assert [item.name for item in world.objects][:3] == ["arm/world", "arm/base", "arm/upper"]
    colors = {item.name: color for item, color in zip(world.objects, world.triangle_colors(), strict=False)}
    assert len(colors) == len(world.objects)
    group = np.array([1, 1, 1, 0, 0, 0], np.uint8)
    for values in ({}, {"pitch": 0.5, "slide": 0.1, "yaw": -0.7, "finger": 0.05}):
        world.set_joints("arm", values)
        data.qpos[:] = qpos(model, robot)
        mujoco.mj_forward(model, data)
        camera = world.camera("arm/wrist")
        np.testing.assert_allclose(camera.C, data.cam_xpos[0], atol=1e-9)
        np.testing.assert_allclose(camera.R, data.cam_xmat[0].reshape(3, 3).T * [[1], [-1], [-1]], atol=1e-6)
        rng = np.random.default_rng(1)
        origins = rng.normal(size=(300, 3)) * 0.2 + [0.2, 0, 1.5]
        ways = np.array([0.3, 0, 0.4]) + rng.normal(size=(300, 3)) * 0.2 - origins
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        hits = world.cast_rays(origins, ways, fields=["t", "instance"])
        links = [robot.objects[item.name] for item in world.objects]
        agree = 0
        for origin, way, t, instance in zip(origins, ways, hits["t"], hits["instance"], strict=True):
            geom = np.array([-1], np.int32)
            expected = mujoco.mj_ray(model, data, origin, way, group, 1, -1, geom, np.zeros(3))
            name = model.body(model.geom_bodyid[geom[0]]).name or f"body{model.geom_bodyid[geom[0]]}"
            agree += abs(t - expected) < 2e-4 and links[instance] == name
        assert agree > 290  # round shapes are tessellated


def test_collision_shapes_are_shown_at_the_robots_location(arm: Path) -> None:
    world = raycam.World()
    robot = world.add_robot(arm, name="two", location=[0, 0, 1], geometry="collision", category="robot")
    assert "two/upper/2" in robot.objects
    assert {item.category for item in world.objects} == {"two"}
    np.testing.assert_allclose(robot.pose("plain")[:3, 3], [1, 0, 1])


def test_world_files_and_command_line_accept_mjcf(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = '[[robot]]\nname = "a"\nfile = "arm.xml"\nlocation = [0, 0, 0.5]\njoints = { yaw = 0.5 }\n'
    (arm.parent / "world.toml").write_text(table)
    world = raycam.load(arm.parent / "world.toml")
    start = world.robots["a"]._kinematics.starts["yaw"]
    assert world.robots["a"].values[start] == 0.5
    image = arm.parent / "arm.png"
    assert main(["render", str(arm), "--size", "40x30", "--joints", "yaw=0.5", "-o", str(image)]) == 0
    assert image.exists()
    capsys.readouterr()


def test_xml_files_with_urdf_or_sdf_are_distinguished_by_their_root(tmp_path: Path) -> None:
    visual = '<visual name="v"><geometry><sphere{}</sphere></geometry></visual>'
    link = f'<link name="a">{visual}</link>'
    urdf, sdf = tmp_path / "urdf.xml", tmp_path / "sdf.xml"
    radius = ' radius="1">'
    urdf.write_text(f'<robot name="u">{link.format(radius)}</robot>')
    sdf.write_text(f'<sdf version="1.9"><model name="s">{link.format("><radius>1</radius>")}</model></sdf>')
    assert list(raycam.load(urdf).robots) == ["u"]
    assert list(raycam.load(sdf).robots) == ["s"]
    other = tmp_path / "other.xml"
    other.write_text("<opencv_storage/>")
    with raises(raycam.FormatError, code="unknown_format", mentions=["<opencv_storage>", "<mujoco>"]):
        raycam.load(other)


def test_mjcf_without_mujoco_raises(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with raises(raycam.SettingsError, code="missing_dependency", mentions=["raycam[mujoco]"]):
        raycam.load(arm)


BAD = {
    "mesh outside": ('file="tip.stl"', 'file="../../secret.stl"', "outside_root", ["secret.stl", ":2"]),
    "absolute mesh": ('file="tip.stl"', 'file="/etc/hostname"', "outside_root", ["/etc/hostname"]),
    "mesh folder outside": ('meshdir="meshes"', 'meshdir="../elsewhere"', "outside_root", ["tip.stl"]),
    "include outside": (
        "<worldbody>",
        '<include file="../part.xml"/><worldbody>',
        "outside_root",
        ["part.xml"],
    ),
    "missing mesh": (
        'file="tip.stl"',
        'file="gone.stl"',
        "file_not_found",
        ["gone.stl", "model/meshes", ":2"],
    ),
    "impossible name": ('file="tip.stl"', f'file="{"a" * 5000}.stl"', "file_not_found", ["aaa", ":2"]),
    "unknown element": ("<worldbody>", "<wordlbody>", None, ["arm.xml"]),
    "unknown key": ('axis="0 0 1"', 'axes="0 0 1"', "invalid_value", ["axes"]),
    "entity": ("<mujoco", '<!DOCTYPE a [<!ENTITY b "c">]><mujoco', "unsupported_feature", ["'b'"]),
    "deep": ("<worldbody>", "<worldbody>" + "<body>" * 200, "budget_exceeded", ["nested"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_models_are_refused(tmp_path: Path, case: str) -> None:
    folder = tmp_path / "model"
    (folder / "meshes").mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir()
    for place in (folder / "meshes/tip.stl", tmp_path / "secret.stl", tmp_path / "elsewhere/tip.stl"):
        place.write_bytes(mesh_bytes())
    (tmp_path / "part.xml").write_text("<mujocoinclude/>")
    before, after, code, mentions = BAD[case]
    assert before in ARM
    (folder / "arm.xml").write_text(ARM.replace(before, after, 1))
    with raises(raycam.FormatError, code=code, mentions=mentions):
        raycam.load(folder / "arm.xml")


def test_models_in_an_mjcf_folder_may_use_the_parent_folder(tmp_path: Path) -> None:
    for name in ("mjcf", "meshes"):
        (tmp_path / name).mkdir()
    (tmp_path / "meshes/tip.stl").write_bytes(mesh_bytes())
    (tmp_path / "mjcf/arm.xml").write_text(ARM.replace('meshdir="meshes"', 'meshdir="../meshes"'))
    assert "arm" in raycam.load(tmp_path / "mjcf/arm.xml").robots


def test_lights_are_loaded_with_the_model_and_reported_as_ignored_by_add_robot(tmp_path: Path) -> None:
    path = tmp_path / "lit.xml"
    path.write_text(
        '<mujoco><worldbody><light type="directional" dir="0 0 -1"/><geom size=".1"/></worldbody></mujoco>'
    )
    world = raycam.load(path)
    assert [light["type"] for light in world.lights] == ["sun", "sky", "sun"]
    # A white surface that faces MuJoCo's headlight has the radiance 0.1 (ambient) + 0.4 (diffuse).
    sky, headlight = world.lights[1]["radiance"], world.lights[2]["irradiance"]
    np.testing.assert_allclose(np.array(sky) + np.array(headlight) / np.pi, 0.5, rtol=1e-6)
    assert list(world.robots) == ["lit"]
    with warns(raycam.Notice, code="ignored_element", mentions=["lights"]):
        raycam.World().add_robot(path)


def test_a_model_with_only_a_headlight_has_no_lights(tmp_path: Path) -> None:
    path = tmp_path / "dark.xml"
    path.write_text('<mujoco><worldbody><geom size=".1"/></worldbody></mujoco>')
    assert raycam.load(path).lights == []


@pytest.mark.parametrize("mode", ["track", "trackcom", "targetbody"])
def test_tracking_cameras_have_mujocos_initial_pose(tmp_path: Path, mode: str) -> None:
    path = tmp_path / "tracked.xml"
    camera = f'<camera name="side" pos="0 -2 1" euler="70 5 0" mode="{mode}" target="a"/>'
    body = f'<body name="a" pos="1 0 .5" euler="0 0 30"><freejoint/><geom size=".1"/>{camera}</body>'
    path.write_text(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    with warns(raycam.Notice, code="approximated_value", mentions=["'side'"]):
        world = raycam.load(path)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    world.set_joints("tracked", [5, 0, 0, 0, 0, 0, 1])  # the camera keeps its position
    camera = world.camera("tracked/side")
    np.testing.assert_allclose(camera.C, data.cam_xpos[0], atol=1e-9)
    np.testing.assert_allclose(camera.R, data.cam_xmat[0].reshape(3, 3).T * [[1], [-1], [-1]], atol=1e-9)
