"""Texture coordinates generated for meshes without any."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import raycam
import trimesh
from raycam.baking.atlas import cells, mesh_with_atlas
from raycam.baking.texels import find_texels
from raycam.world.object_mesh import ObjectMesh, object_mesh
from support.raises import raises


def mesh_of(shape: trimesh.Trimesh) -> ObjectMesh:
    world = raycam.World()
    world.add_mesh(shape.vertices, shape.faces)
    return object_mesh(world, 0)


SHAPES = {
    "ball": trimesh.creation.icosphere(subdivisions=3),
    "box": trimesh.creation.box(),
    "torus": trimesh.creation.torus(1, 0.3),
    "soup": trimesh.Trimesh(
        np.random.default_rng(0).random((120, 3)), np.arange(120).reshape(-1, 3), process=False
    ),
}


@pytest.mark.parametrize("atlas", ["xatlas", "cells"])
@pytest.mark.parametrize("shape", SHAPES)
def test_every_face_has_its_own_texels(shape: str, atlas: str) -> None:
    mesh = mesh_with_atlas(mesh_of(SHAPES[shape]), atlas, 512)
    texels = find_texels(mesh.uvs[0], (512, 512))
    assert texels.overlapping == 0
    assert set(texels.face.tolist()) == set(range(mesh.faces))
    assert mesh.uvs[0].min() >= 0
    assert mesh.uvs[0].max() <= 1


def test_charts_of_a_sphere_have_texel_areas_within_a_factor_of_3() -> None:
    mesh = mesh_with_atlas(mesh_of(SHAPES["ball"]), "xatlas", 512)
    uv = mesh.uvs[0].astype(float)
    in_texture = (
        np.abs(np.cross(uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]))
        if uv.shape[2] == 3
        else np.abs(
            (uv[:, 1] - uv[:, 0])[:, 0] * (uv[:, 2] - uv[:, 0])[:, 1]
            - (uv[:, 1] - uv[:, 0])[:, 1] * (uv[:, 2] - uv[:, 0])[:, 0]
        )
    )
    ratio = (
        in_texture
        / trimesh.Trimesh(
            mesh.corners.reshape(-1, 3), np.arange(3 * mesh.faces).reshape(-1, 3), process=False
        ).area_faces
    )
    assert ratio.max() < 3 * ratio.min()
    assert in_texture.sum() / 2 > 0.4  # the atlas uses more than 40 % of the texture


def test_atlas_cells_are_right_angled_and_too_many_are_refused() -> None:
    uv = cells(7, 64)
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    np.testing.assert_allclose((a * b).sum(axis=1), 0, atol=1e-12)
    with raises(raycam.SettingsError, code="out_of_range", mentions=["5000 faces", "size=200"]):
        cells(5000, 128)


def test_missing_library_is_reported_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xatlas", None)
    with raises(raycam.SettingsError, code="missing_dependency", mentions=["raycam[atlas]", "cells"]):
        mesh_with_atlas(mesh_of(SHAPES["box"]), "xatlas", 64)
    with raises(raycam.SettingsError, mentions=["atlas"]):
        mesh_with_atlas(mesh_of(SHAPES["box"]), "auto", 64)
