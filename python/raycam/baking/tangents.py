"""Tangents of MikkTSpace, which baked normal maps and renderers share."""

from __future__ import annotations

import json
import struct

import numpy as np

from .. import _core
from ..arguments import Floats
from ..io.glb import GlbBuilder
from ..world.object_mesh import attributes_of

__all__ = ["corner_tangents", "tangent_space_normals"]


def corner_tangents(positions: Floats, normals: Floats, uvs: Floats) -> Floats:
    """Returns the tangents and bitangent signs [f, 3, 4] of corners.

    The corners have positions and normals [f, 3, 3], and `uvs` [f, 3, 2]. The result equals the tangents that
    are computed for a glTF file without tangents, with v down (glTF 2.0, 3.7.2.1). Source: Mikkelsen,
    Simulation of wrinkled surfaces revisited, 2008.
    """
    rows = np.concatenate([positions, normals, uvs], axis=2).reshape(-1, 8).astype(np.float32)
    vertices, faces = np.unique(rows, axis=0, return_inverse=True)
    glb = GlbBuilder()
    attributes = {
        "POSITION": glb.floats(vertices[:, :3]),
        "NORMAL": glb.floats(vertices[:, 3:6]),
        "TEXCOORD_0": glb.floats(vertices[:, 6:]),
    }
    flat = glb.texture(np.array([[[128, 128, 255]]], np.uint8))
    material = glb.add("materials", normalTexture={"index": flat})
    part = {"attributes": attributes, "indices": glb.indices(faces.reshape(-1, 3)), "material": material}
    glb.add("nodes", mesh=glb.add("meshes", primitives=[part]))
    data, _ = _core.world_to_gltf(_core.world_from_gltf(glb.bytes(), "tangents.glb", "y", []))
    length = struct.unpack("<I", data[12:16])[0]
    document, binary = json.loads(data[20 : 20 + length]), memoryview(data)[28 + length :]
    found: Floats = attributes_of(document, binary, document["meshes"][0]["primitives"][0])["TANGENT"].astype(
        np.float64
    )
    return found


def tangent_space_normals(normals: Floats, shading: Floats, tangents: Floats, signs: Floats) -> Floats:
    """Returns `normals` [n, 3] as unit normals [n, 3] in tangent space.

    The x axis is along `tangents` [n, 3], the z axis along `shading` [n, 3], and `signs` [n] are the signs of the y
    axis. Tangents need not be perpendicular to the normals: the sum of the axes, each multiplied by its
    component of the result, has the direction of `normals`, as in renderers.
    """
    tangent = tangents / np.maximum(np.sqrt((tangents**2).sum(axis=1, keepdims=True)), 1e-300)
    bitangent = np.cross(shading, tangent) * signs[:, None]
    bitangent /= np.maximum(np.sqrt((bitangent**2).sum(axis=1, keepdims=True)), 1e-300)
    # Cramer's rule; solutions by LAPACK would depend on the processor.
    across = [np.cross(bitangent, shading), np.cross(shading, tangent), np.cross(tangent, bitangent)]
    volume = (tangent * across[0]).sum(axis=1)
    flat = np.abs(volume) < 1e-9  # faces without area in texture space
    found: Floats = np.stack([(normals * axis).sum(axis=1) for axis in across], axis=1)
    found *= np.sign(volume)[:, None]
    found[flat] = [0, 0, 1]
    found = found / np.sqrt((found**2).sum(axis=1, keepdims=True))
    return found
