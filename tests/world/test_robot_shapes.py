"""The visual and collision shapes of robots."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.cli import main
from support.raises import raises

ROBOT = """<robot name="r">
  <link name="a"><visual><geometry><box size="1 1 1"/></geometry></visual>
    <collision><geometry><box size="2 2 1"/></geometry></collision>
    <collision><origin xyz="0 0 1"/><geometry><sphere radius="0.5"/></geometry></collision></link>
  <link name="b"><collision><geometry><box size="1 1 3"/></geometry></collision></link>
  <joint name="j" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="9" effort="1" velocity="1"/></joint>
</robot>"""
MODEL = """<mujoco model="r"><worldbody><body name="a">
  <geom type="box" size="1 1 1" contype="0" conaffinity="0"/><geom type="sphere" size="0.5" group="3"/>
  <geom type="box" size="0.1 0.1 2"/></body></worldbody></mujoco>"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "r.urdf").write_text(ROBOT, encoding="utf-8")
    return tmp_path / "r.urdf"


@pytest.mark.parametrize(
    ("geometry", "names"),
    [
        (None, ["r/a"]),
        ("visual", ["r/a"]),
        ("collision", ["r/a", "r/a/2", "r/b"]),
        ("both", ["r/a", "r/a/collision", "r/a/collision/2", "r/b/collision"]),
    ],
)
def test_geometry_selects_the_shapes(path: Path, geometry: str | None, names: list[str]) -> None:
    world = raycam.load(path, geometry=geometry)  # type: ignore[arg-type]
    assert [item.name for item in world.objects] == names


def test_collision_shapes_beside_visual_shapes_are_half_transparent_and_move(path: Path) -> None:
    world = raycam.load(path, geometry="both")
    world.set_joints("r", {"j": 4})
    np.testing.assert_allclose(world.objects[3].matrix[:3, 3], [4, 0, 0])
    camera = raycam.Camera.look_at([0, -9, 0], [0, 0, 0], size=(9, 9), fov=20)
    shown = raycam.render(world, camera, integrator="direct", samples=64)["color"][4, 4]
    alone = raycam.render(raycam.load(path), camera, integrator="direct", samples=64)["color"][4, 4]
    assert shown[0] > 1.5 * shown[2]
    assert alone[0] < 1.2 * alone[2]


def test_meshes_with_their_own_materials_are_half_transparent_as_collision_shapes(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 0 1\nusemtl m\nf 1 2 3\n")
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 0 0 1\n")
    (tmp_path / "r.urdf").write_text(
        '<robot name="r"><link name="a"><collision><geometry><mesh filename="a.obj"/></geometry></collision>'
        "</link></robot>"
    )
    world = raycam.load(tmp_path / "r.urdf", geometry="both")
    camera = raycam.Camera.look_at([0.2, -5, 0.2], [0.2, 0, 0.2], size=(3, 3), fov=2)
    color = raycam.render(world, camera, integrator="flat", samples=64)["color"][1, 1]
    assert color[0] > 1.5 * color[2]


def test_colliding_geoms_of_mjcf_that_are_not_visible_are_added(tmp_path: Path) -> None:
    (tmp_path / "r.xml").write_text(MODEL, encoding="utf-8")
    world = raycam.load(tmp_path / "r.xml", geometry="both")
    assert [item.name for item in world.objects] == ["r/a", "r/a/collision", "r/a/2"]
    assert [item.name for item in raycam.load(tmp_path / "r.xml").objects] == ["r/a", "r/a/2"]
    assert len(raycam.load(tmp_path / "r.xml", geometry="collision").objects) == 2


def test_geometry_of_other_files_and_unknown_geometry_raise(path: Path) -> None:
    mesh = path.with_name("a.obj")
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n", encoding="utf-8")
    with raises(raycam.SettingsError, code="conflicting_values", mentions=["geometry="]):
        raycam.load(mesh, geometry="both")
    with raises(raycam.SettingsError, code="conflicting_values", mentions=["geometry="]):
        raycam.load(b"ply\n", kind="ply", geometry="both")
    with raises(raycam.Error, mentions=["visual", "collision", "both"]):
        raycam.load(path, geometry="all")  # type: ignore[arg-type]


def test_command_line_option_selects_the_shapes(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    options = ["--channels", "instance", "--size", "40x30", "-o", "a.npz"]
    for geometry, count in (("both", 4), ("visual", 1)):
        assert main(["render", "r.urdf", "--geometry", geometry, *options]) == 0
        assert np.load("a.npz")["instance"].max() < count
        assert (np.load("a.npz")["instance"].max() > 0) == (geometry == "both")
