"""Maps baked to vertices, compared with closed forms and read back from glTF files."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import raycam
import trimesh
from raycam.cli import main
from support.raises import raises


def test_normals_at_a_boxs_corners_are_means_by_area() -> None:
    world = raycam.World()
    size = np.array([1.0, 2.0, 3.0])
    world.add_object(box={"size": size.tolist()})
    baked = raycam.bake(world, ["normal"], to="vertices")
    assert baked.vertices is not None
    assert baked.faces is not None
    assert baked["normal"].shape == (8, 3)
    corners = baked.vertices[baked.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    expected = np.zeros((8, 3))
    for corner in range(3):
        np.add.at(expected, baked.faces[:, corner], across)  # twice the area times the normal
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(baked["normal"], expected, atol=1e-6)
    judge = trimesh.Trimesh(baked.vertices, baked.faces, process=False)
    assert judge.is_watertight
    assert judge.volume == pytest.approx(6.0)


def test_ao_at_the_foot_of_an_endless_wall_is_one_half() -> None:
    world = raycam.World()
    strip = [[0, -1, 0], [0, 1, 0], [1000, 1, 0], [1000, -1, 0]]
    world.add_mesh(strip, [[0, 3, 2], [0, 2, 1]], name="floor")
    wall = [[0, -1e6, 0], [0, 1e6, 0], [0, 1e6, 1e6], [0, -1e6, 1e6]]
    world.add_mesh(wall, [[0, 1, 2], [0, 2, 3]], name="wall")
    baked = raycam.bake(world, ["ao"], object="floor", to="vertices", samples=4096)
    assert baked.vertices is not None
    # Rays start 1 % inside of the face, up to 10 m from a wall of a thousand kilometres.
    np.testing.assert_allclose(baked["ao"], 0.5, atol=0.02)


def glb_arrays(path: Path) -> dict[str, np.ndarray]:
    """The float32 attributes of a glTF file's only primitive (glTF 2.0, 3.6 and 4.4)."""
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    document, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    found = {}
    for name, number in document["meshes"][0]["primitives"][0]["attributes"].items():
        accessor = document["accessors"][number]
        assert (accessor["type"], accessor["componentType"]) == ("VEC3", 5126)
        view = document["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        stride = view.get("byteStride", 12)
        found[name] = np.ndarray((accessor["count"], 3), np.float32, binary, start, (stride, 4))
    return found


def test_files_of_vertices_contain_linear_vertex_colours(tmp_path: Path) -> None:
    world = raycam.World("y")
    world.add_object(sphere={"radius": 1, "level": 2})
    world.add_object(box={"size": [3, 0.1, 3]}, location=[0, -1.05, 0])
    baked = raycam.bake(world, ["ao", "curvature"], to="vertices", samples=64)
    paths = baked.save(tmp_path)
    assert [path.name for path in paths] == ["ao.glb", "curvature.glb"]
    read = glb_arrays(paths[0])
    assert baked.vertices is not None
    order, own = np.lexsort(read["POSITION"].T), np.lexsort(baked.vertices.astype(np.float32).T)
    np.testing.assert_allclose(read["POSITION"][order], baked.vertices[own], atol=1e-6)
    expected = np.repeat(baked["ao"][own][:, None], 3, axis=1)
    np.testing.assert_allclose(read["COLOR_0"][order], expected, atol=1e-6)
    assert baked["ao"].std() > 0.1


def test_vertex_light_and_its_error_are_means_over_the_faces() -> None:
    world = raycam.World()
    world.add_object(box={"size": [2, 2, 2]}, name="box")
    world.add_light(type="sky", radiance=[1.0, 1.0, 1.0])
    baked = raycam.bake(world, ["irradiance"], object="box", to="vertices", samples=512)
    np.testing.assert_allclose(baked["irradiance"], np.pi, rtol=0.02)
    assert baked["irradiance_error"].shape == (8,)
    assert (baked["irradiance_error"] < 0.2).all()


def test_vertices_without_a_source_surface_are_reported() -> None:
    low, high = raycam.World(), raycam.World()
    low.add_object(plane={"size": [2, 2]})
    high.add_object(plane={"size": [4, 4]}, location=[2.5, 0, 0.01])
    with pytest.warns(raycam.Notice) as caught:
        baked = raycam.bake(low, ["position"], source=high, cage=0.05, to="vertices")
    assert [warning.message.code for warning in caught] == ["missed_source"]  # type: ignore[union-attr]
    assert baked.vertices is not None
    right = baked.vertices[:, 0] > 0
    np.testing.assert_array_equal(baked.missed, ~right)
    np.testing.assert_allclose(baked["position"][:, 2], np.where(right, 0.01, 0), atol=1e-7)


@pytest.mark.parametrize(
    "options",
    [{"maps": ["tangent_normal"]}, {"maps": ["triangle"]}, {"atlas": "cells"}, {"denoise": True}],
)
def test_baking_to_vertices_refuses_options_for_textures(options: dict) -> None:
    world = raycam.World()
    world.add_object(box={"size": [1, 1, 1]})
    with raises(raycam.SettingsError, code="conflicting_values"):
        raycam.bake(world, to="vertices", **options)


def test_colours_outside_the_range_are_refused() -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 0.2, "level": 2})
    baked = raycam.bake(world, ["curvature"], to="vertices")
    with raises(raycam.SettingsError, code="out_of_range", mentions=["curvature"]):
        baked.to_world("curvature")
    shown = baked.to_world("curvature", 0, 10)
    assert shown.counts["triangles"] == world.counts["triangles"]
    with raises(raycam.SettingsError, code="unknown_name", mentions=["ao", "curvature"]):
        baked.to_world("ao")
    with raises(raycam.SettingsError, code="missing_value", mentions=["vertices"]):
        raycam.bake(world, ["normal"], size=4).to_world("normal")


def test_command_bakes_vertices_into_a_glb(tmp_path: Path) -> None:
    world = raycam.World("y")
    world.add_object(sphere={"radius": 1, "level": 2})
    world.to_gltf(tmp_path / "ball.glb")
    out = tmp_path / "baked.glb"
    common = ["bake", str(tmp_path / "ball.glb"), "--to", "vertices", "--samples", "4"]
    assert main([*common, "-o", str(out)]) == 0
    assert raycam.load(out).counts["triangles"] == world.counts["triangles"]
    assert main([*common, "--maps", "ao", "curvature", "-o", str(tmp_path / "maps")]) == 0
    assert sorted(path.name for path in (tmp_path / "maps").iterdir()) == ["ao.glb", "curvature.glb"]
