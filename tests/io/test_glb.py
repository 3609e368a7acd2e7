"""GLB files assembled in memory, read by trimesh."""

from __future__ import annotations

import io

import numpy as np
import trimesh
from raycam.io.glb import GlbBuilder


def test_assembled_glb_is_read_by_trimesh() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [1, 2, 0]], np.float32)
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    uvs = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    pixels = np.random.default_rng(4).integers(0, 256, (2, 3, 3), np.uint8)
    glb = GlbBuilder()
    texture = {"index": glb.texture(pixels, "noise")}
    material = glb.add(
        "materials", name="paint", alphaMode=None, pbrMetallicRoughness={"baseColorTexture": texture}
    )
    attributes = {"POSITION": glb.floats(corners), "TEXCOORD_0": glb.floats(uvs)}
    primitive = {"attributes": attributes, "indices": glb.indices(faces), "material": material}
    glb.add("nodes", mesh=glb.add("meshes", primitives=[primitive]), translation=[5, 0, 0])
    scene = trimesh.load(io.BytesIO(glb.bytes()), file_type="glb")
    mesh = scene.to_geometry()
    np.testing.assert_array_equal(mesh.triangles, corners[faces] + [5, 0, 0])
    image = next(iter(scene.geometry.values())).visual.material.baseColorTexture
    np.testing.assert_array_equal(np.asarray(image), pixels)
    np.testing.assert_array_equal(glb._lists["accessors"][0]["max"], [1, 2, 0])
