"""Meshes of robots: their kinds, materials, and files that are missing."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import raycam
from support.raises import raises, warns

TRIANGLE = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 1, 0], [0, 0, 2]]], np.float32)


def write_stl(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *corners.ravel(), 0) for corners in TRIANGLE)
    path.write_bytes(bytes(80) + struct.pack("<I", len(TRIANGLE)) + rows)


def write_robot(folder: Path, *meshes: str, extra: str = "") -> Path:
    """A robot with one link that shows meshes, in folder/urdf."""
    visuals = "\n".join(
        f'<visual><geometry><mesh filename="{mesh}" {extra}/></geometry>'
        '<material name="m"><color rgba="0 0 1 1"/></material></visual>'
        for mesh in meshes
    )
    path = folder / "urdf" / "r.urdf"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'<robot name="r"><link name="a">\n{visuals}\n</link></robot>', encoding="utf-8")
    return path


def test_scale_of_a_mesh_is_applied_and_may_mirror(tmp_path: Path) -> None:
    write_stl(tmp_path / "bot/meshes/a.stl")
    path = write_robot(tmp_path / "bot", "package://bot/meshes/a.stl", extra='scale="1 -2 0.5"')
    world = raycam.load(path)
    np.testing.assert_allclose(world.triangles().reshape(2, 3, 3), TRIANGLE * [1, -2, 0.5], atol=1e-7)


def test_color_of_the_description_applies_to_meshes_without_materials(tmp_path: Path) -> None:
    write_stl(tmp_path / "meshes/a.stl")
    obj = "mtllib b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"
    (tmp_path / "meshes/b.obj").write_text(obj, encoding="utf-8")
    (tmp_path / "meshes/b.mtl").write_text("newmtl red\nKd 1 0 0\n", encoding="utf-8")
    plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (tmp_path / "meshes/c.obj").write_text(plain, encoding="utf-8")
    path = write_robot(tmp_path, *(f"../meshes/{name}" for name in ("a.stl", "b.obj", "c.obj")))
    world = raycam.load(path)
    colors = {
        number: color
        for (number, _), color in zip(world.triangle_ids(), world.triangle_colors(), strict=True)
    }
    np.testing.assert_allclose(
        [colors[0], colors[1], colors[2]], [[0, 0, 1], [1, 0, 0], [0, 0, 1]], atol=1e-6
    )


def test_all_missing_meshes_are_listed_with_lines_and_folders(tmp_path: Path) -> None:
    path = write_robot(tmp_path / "bot", "package://bot/one.stl", "package://other/two.stl", "three.fbx")
    (path.parent / "three.fbx").write_bytes(b"x")
    with pytest.raises(raycam.FormatError) as caught:
        raycam.load(path)
    text = str(caught.value)
    assert "(3)" in text
    for part in (
        f"{path}:2: ",
        "one.stl",
        f"{path}:3: ",
        "'other'",
        str(tmp_path),
        f"{path}:4: ",
        ".fbx",
        "packages=",
    ):
        assert part in text


def test_missing_meshes_become_boxes_with_notices(tmp_path: Path) -> None:
    path = write_robot(tmp_path, "one.stl", "two.stl")
    world = raycam.World()
    with warns(raycam.Notice, code="ignored_element", mentions=["one.stl"]):
        world.add_robot(path, missing="box")
    assert [item.triangles for item in world.objects] == [12, 12]
    assert len(world.notices) == 2


def test_collision_shapes_replace_missing_meshes(tmp_path: Path) -> None:
    path = write_robot(tmp_path, "one.stl")
    shape = '<collision><geometry><sphere radius="0.3"/></geometry></collision></link>'
    path.write_text(path.read_text(encoding="utf-8").replace("</link>", shape), encoding="utf-8")
    world = raycam.World()
    world.add_robot(path, missing="box")
    np.testing.assert_allclose(world.bounds, [[-0.3] * 3, [0.3] * 3], atol=1e-3)


def test_faulty_mesh_leaves_the_world_unchanged(tmp_path: Path) -> None:
    write_stl(tmp_path / "a.stl")
    (tmp_path / "b.stl").write_bytes(b"solid x\nfacet")
    path = write_robot(tmp_path, "../a.stl", "../b.stl")
    world = raycam.World()
    world.add_object(box=1.0)
    with raises(raycam.FormatError, code="truncated_file", mentions=["b.stl"]):
        world.add_robot(path)
    assert len(world.objects) == 1
    assert not world.robots


def test_arguments_that_robots_do_not_support_raise(tmp_path: Path) -> None:
    path = write_robot(tmp_path)
    for options in (
        {"variant": "a"},
        {"time": 1.0},
        {"up": "y"},
        {"packages": "x"},
        {"packages": [tmp_path / "none"]},
    ):
        with pytest.raises(raycam.SettingsError):
            raycam.load(path, **options)  # type: ignore[arg-type]
    for options in (
        {"geometry": "x"},
        {"missing": "x"},
        {"category": "x"},
        {"name": 3},
        {"matrix": np.zeros((4, 4))},
    ):
        with pytest.raises((raycam.SettingsError, raycam.WorldError)):
            raycam.World().add_robot(path, **options)  # type: ignore[arg-type]
    with pytest.raises(FileNotFoundError):
        raycam.load(tmp_path / "none.urdf")


@pytest.mark.parametrize(
    ("material", "expected"),
    [
        ('<material name="m"><color rgba="0 1 0 1"/></material>', [[0, 1, 0], [0, 1, 0]]),
        ("", [[1, 0, 0], [0, 0, 1]]),
    ],
)
def test_urdf_color_replaces_the_colors_of_stl_facets(
    tmp_path: Path, material: str, expected: list[list[float]]
) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    words = (0x8000 | 31 << 10, 0x8000 | 31)  # red and blue, as VisCAM writes them
    heights = (0.0, 1.0)
    facets = [
        struct.pack("<12fH", 0, 0, 1, *np.add(corners, [0, 0, height]).ravel(), word)
        for height, word in zip(heights, words, strict=True)
    ]
    (tmp_path / "a.stl").write_bytes(bytes(80) + struct.pack("<I", 2) + b"".join(facets))
    visual = f'<visual><geometry><mesh filename="a.stl"/></geometry>{material}</visual>'
    (tmp_path / "r.urdf").write_text(
        f'<robot name="r"><link name="a">{visual}</link></robot>', encoding="utf-8"
    )
    world = raycam.load(tmp_path / "r.urdf")
    np.testing.assert_allclose(world.triangle_colors(), expected, atol=1e-6)
    assert not world.notices
