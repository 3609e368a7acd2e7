"""SDF models: frames, joints, shapes and cameras, with closed forms."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import raycam
from raycam import FormatError
from support.raises import raises, warns

BOX = '<visual name="v"><geometry><box><size>0.1 0.1 0.1</size></box></geometry></visual>'
ARM = f"""<sdf version="1.9"><model name="arm"><pose>0 0 1 0 0 0</pose>
<link name="base"><pose>0 0 0.5 0 0 0</pose>{BOX}</link>
<link name="upper"><pose relative_to="base">0 0 1 0 0 0</pose>{BOX}</link>
<link name="lower"><pose relative_to="elbow">0 0 -0.25 0 0 0</pose>{BOX}</link>
<joint name="shoulder" type="revolute"><pose>0 0 -0.5 0 0 0</pose><parent>base</parent><child>upper</child>
<axis><xyz>0 1 0</xyz><limit><lower>-2</lower><upper>2</upper></limit></axis></joint>
<frame name="elbow" attached_to="upper"><pose>0 0 0.5 0 0 0</pose></frame>
<joint name="bend" type="continuous"><pose relative_to="elbow"/><parent>upper</parent><child>lower</child>
<axis><xyz expressed_in="base">0 1 0</xyz></axis></joint></model></sdf>"""


def load(folder: Path, text: str, **options) -> raycam.World:
    (folder / "robot.sdf").write_text(text)
    return raycam.load(folder / "robot.sdf", **options)


def turn_y(angle: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[0, 0] = matrix[2, 2] = np.cos(angle)
    matrix[0, 2], matrix[2, 0] = np.sin(angle), -np.sin(angle)
    return matrix


def move(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = [x, y, z]
    return matrix


def test_links_are_at_their_poses_and_joints_turn_about_their_own_frames(tmp_path: Path) -> None:
    world = load(tmp_path, ARM)
    arm = world.robots["arm"]
    assert arm.joints == ("shoulder", "bend")
    assert arm.limits["shoulder"] == (-2.0, 2.0)
    np.testing.assert_allclose(arm.pose("base"), move(0, 0, 1.5), atol=1e-15)
    np.testing.assert_allclose(arm.pose("upper"), move(0, 0, 2.5), atol=1e-15)
    np.testing.assert_allclose(arm.pose("lower"), move(0, 0, 2.75), atol=1e-15)
    world.set_joints("arm", {"shoulder": 0.4, "bend": -1.1})
    upper = move(0, 0, 2.0) @ turn_y(0.4) @ move(0, 0, 0.5)
    lower = upper @ move(0, 0, 0.5) @ turn_y(-1.1) @ move(0, 0, -0.25)
    np.testing.assert_allclose(arm.pose("upper"), upper, atol=1e-14)
    np.testing.assert_allclose(arm.pose("lower"), lower, atol=1e-14)
    np.testing.assert_allclose(world.objects[2].matrix, lower, atol=1e-14)


def test_jacobian_equals_finite_differences(tmp_path: Path) -> None:
    arm = load(tmp_path, ARM).robots["arm"]
    q, h = np.array([0.3, -0.7]), 1e-6
    jacobian = arm.jacobian("lower", q)
    for i in range(2):
        step = np.eye(2)[i] * h
        difference = (arm.pose("lower", q + step) - arm.pose("lower", q - step)) / (2 * h)
        np.testing.assert_allclose(jacobian[:3, i], difference[:3, 3], atol=1e-8)
        spin = difference[:3, :3] @ arm.pose("lower", q)[:3, :3].T
        np.testing.assert_allclose(jacobian[3:, i], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-8)


@pytest.mark.parametrize(
    ("pose", "expected"),
    [
        ("<pose>1 2 3 0 0 1.5707963267948966</pose>", [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3]]),
        ('<pose degrees="true">1 2 3 0 0 90</pose>', [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3]]),
        (
            '<pose rotation_format="quat_xyzw">1 2 3 0 0 1 1</pose>',
            [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3]],
        ),
        ("<pose/>", [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]),
    ],
)
def test_poses_are_read_in_all_notations(tmp_path: Path, pose: str, expected: list[list[float]]) -> None:
    world = load(
        tmp_path, f'<sdf version="1.9"><model name="m"><link name="a">{pose}{BOX}</link></model></sdf>'
    )
    np.testing.assert_allclose(world.robots["m"].pose("a")[:3], expected, atol=1e-15)


def test_worlds_contain_several_models_and_nested_models(tmp_path: Path) -> None:
    inner = f'<model name="hand"><pose relative_to="base">0 0 1 0 0 0</pose><link name="palm">{BOX}</link></model>'
    world = load(
        tmp_path,
        f'<sdf version="1.9"><world name="w"><model name="a"><pose>1 0 0 0 0 0</pose><link name="base">{BOX}</link>'
        f'{inner}</model><model name="a"><link name="base">{BOX}</link></model></world></sdf>',
    )
    assert list(world.robots) == ["a", "a-2"]
    np.testing.assert_allclose(world.robots["a"].pose("hand::palm"), move(1, 0, 1), atol=1e-15)
    assert [item.name for item in world.objects] == ["a/base", "a/hand::palm", "a-2/base"]
    with pytest.raises(FormatError) as refused:
        raycam.World().add_robot(tmp_path / "robot.sdf")
    assert refused.value.code == "unsupported_feature"


def test_includes_are_found_as_packages_and_placed(tmp_path: Path) -> None:
    part = tmp_path / "models" / "part"
    part.mkdir(parents=True)
    (part / "part.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (part / "model.sdf").write_text(
        '<sdf version="1.9"><model name="part"><pose>9 9 9 0 0 0</pose><link name="l"><visual name="v"><geometry><mesh>'
        "<uri>part.obj</uri></mesh></geometry></visual></link></model></sdf>"
    )
    world = load(
        tmp_path,
        '<sdf version="1.9"><world name="w"><include><uri>model://part</uri><name>p</name><pose>1 2 3 0 0 0</pose>'
        "</include><include><uri>model://part</uri></include></world></sdf>",
        packages=[tmp_path / "models"],
    )
    np.testing.assert_allclose(world.robots["p"].pose("l"), move(1, 2, 3), atol=1e-15)
    np.testing.assert_allclose(world.robots["part"].pose("l"), move(9, 9, 9), atol=1e-15)


def test_files_that_include_themselves_are_refused(tmp_path: Path) -> None:
    loop = tmp_path / "loop"
    loop.mkdir()
    (loop / "model.sdf").write_text(
        '<sdf version="1.9"><model name="m"><link name="a"/><include><uri>model://loop</uri></include></model></sdf>'
    )
    with raises(FormatError, mentions=["circle"]):
        raycam.load(loop / "model.sdf", packages=[tmp_path])


def test_cameras_follow_their_links_with_opencvs_distortion(tmp_path: Path) -> None:
    camera = """<sensor name="eye" type="camera"><pose>0.1 0 0 0 0 0</pose><camera><horizontal_fov>1.2</horizontal_fov>
<image><width>64</width><height>48</height></image><distortion><k1>-0.2</k1><k2>0.05</k2><k3>0.01</k3><p1>0.002</p1>
<p2>-0.003</p2></distortion></camera></sensor><sensor name="beam" type="gpu_lidar"/>"""
    text = ARM.replace(f"0 0 -0.25 0 0 0</pose>{BOX}", f"0 0 -0.25 0 0 0</pose>{BOX}{camera}")
    with pytest.warns(raycam.Notice) as notices:
        world = load(tmp_path, text)
    assert [notice.message.code for notice in notices] == ["ignored_element"]
    world.set_joints("arm", {"shoulder": 0.4, "bend": -1.1})
    eye = world.cameras["arm/eye"]
    pose = world.robots["arm"].pose("lower") @ move(0.1, 0, 0)
    np.testing.assert_allclose(eye.location, pose[:3, 3], atol=1e-12)
    # The axes are x forward, y left, z up.
    points = np.array([[2.0, 0.3, 0.2], [3.0, -0.8, 0.5], [1.5, 0.1, -0.4]])
    seen = eye.project((pose[:3, :3] @ points.T).T + pose[:3, 3])[0]
    optical = np.stack([-points[:, 1], -points[:, 2], points[:, 0]], axis=1)
    focal = 32 / np.tan(0.6)
    K = np.array([[focal, 0, 32], [0, focal, 24], [0, 0, 1]])  # the centre of the first pixel is at 0.5
    expected, _ = cv2.projectPoints(
        optical, np.zeros(3), np.zeros(3), K, np.array([-0.2, 0.05, 0.002, -0.003, 0.01])
    )
    np.testing.assert_allclose(seen, expected[:, 0], atol=1e-9)


def test_shapes_have_their_sizes(tmp_path: Path) -> None:
    shapes = {
        "<box><size>1 2 3</size></box>": [1, 2, 3],
        "<sphere><radius>2</radius></sphere>": [4, 4, 4],
        "<cylinder><radius>1</radius><length>3</length></cylinder>": [2, 2, 3],
        "<capsule><radius>1</radius><length>3</length></capsule>": [2, 2, 5],
        "<ellipsoid><radii>1 2 3</radii></ellipsoid>": [2, 4, 6],
        "<plane><normal>1 0 0</normal><size>2 4</size></plane>": [0, 4, 2],
    }
    for shape, size in shapes.items():
        text = f'<sdf version="1.9"><model name="m"><link name="a"><visual name="v"><geometry>{shape}'
        with raycam.notices.collected():
            world = load(tmp_path, f"{text}</geometry></visual></link></model></sdf>")
        low, high = world.bounds
        np.testing.assert_allclose(np.sort(high - low), np.sort(size), atol=1e-2)


def test_loops_of_joints_are_opened_with_a_notice(tmp_path: Path) -> None:
    joint = (
        '<joint name="loop" type="revolute"><parent>base</parent><child>lower</child>'
        "<axis><xyz>0 1 0</xyz></axis></joint>"
    )
    with warns(raycam.Notice, mentions=["loop"]):
        world = load(tmp_path, ARM.replace("</model>", f"{joint}</model>"))
    assert world.robots["arm"].joints == ("shoulder", "bend")


@pytest.mark.parametrize(
    ("old", "new", "fact"),
    [
        ('relative_to="base"', 'relative_to="basis"', "did you mean 'base'"),
        ('attached_to="upper"', 'attached_to="lower"', "circle"),
        ("<child>lower</child>", "<child>lowre</child>", "lower"),
        ("<xyz>0 1 0</xyz><limit>", "<xyz>0 0 0</xyz><limit>", "axis"),
        ("0 0 0.5 0 0 0", "0 0 0.5 0 0", "6 finite numbers"),
        ('<link name="upper">', '<link name="base">', "duplicate"),
        ("<lower>-2</lower>", "<lower>3</lower>", "exceeds"),
        ("<size>0.1 0.1 0.1</size>", "<size>0.1 -1 0.1</size>", "negative"),
        ('<model name="arm">', '<light name="arm">', "no models"),
    ],
)
def test_malformed_files_are_refused_with_file_and_line(
    tmp_path: Path, old: str, new: str, fact: str
) -> None:
    text = ARM.replace(old, new, 1)
    if "light" in new:
        text = text.replace("</model>", "</light>")
    with raises(FormatError, mentions=[fact]) as refused:
        load(tmp_path, text)
    assert "robot.sdf" in str(refused.value)


def material_of(folder: Path, text: str) -> dict:
    visual = BOX.replace("</visual>", f"<material>{text}</material></visual>")
    world = load(folder, f'<sdf version="1.9"><model name="m"><link name="a">{visual}</link></model></sdf>')
    return json.loads(world._core.material(0, 0))


def test_pbr_values_and_emission_become_the_material(tmp_path: Path) -> None:
    pbr = "<pbr><metal><roughness>0.25</roughness><metalness>0.75</metalness></metal></pbr>"
    found = material_of(tmp_path, f"<diffuse>1 1 1 1</diffuse><emissive>1 0.5 0 1</emissive>{pbr}")
    values = found["model"]["Principled"]
    assert (values["roughness"]["value"], values["metallic"]["value"]) == (0.25, 0.75)
    half = ((0.5 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(found["emission"]["value"], [1, half, 0], rtol=1e-6)
    plain = material_of(tmp_path, "<diffuse>1 1 1 1</diffuse><emissive>0 0 0 1</emissive>")
    assert plain["emission"]["value"] == [0, 0, 0]
    assert "Principled" not in plain["model"]


@pytest.mark.parametrize(
    ("text", "facts"),
    [
        ("<pbr><metal><roughness>1.5</roughness></metal></pbr>", ["<roughness>", "1.5"]),
        ("<pbr><metal><metalness>x</metalness></metal></pbr>", ["x"]),
        ("<emissive>2 0 0 1</emissive>", ["0 and 1"]),
    ],
)
def test_invalid_material_values_are_refused(tmp_path: Path, text: str, facts: list[str]) -> None:
    with raises(FormatError, mentions=["robot.sdf:1", *facts]):
        material_of(tmp_path, text)


def test_unsupported_material_maps_are_reported(tmp_path: Path) -> None:
    with warns(raycam.Notice, code="ignored_element", mentions=["pbr/normal_map"]):
        material_of(tmp_path, "<pbr><metal><normal_map>n.png</normal_map></metal></pbr>")
