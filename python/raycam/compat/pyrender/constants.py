"""Constants of pyrender."""

from __future__ import annotations

__all__ = ["GLTF", "RenderFlags", "TextAlign"]

DEFAULT_Z_NEAR, DEFAULT_Z_FAR = 0.05, 100.0
DEFAULT_SCENE_SCALE = 2.0
MAX_N_LIGHTS = 4
"""pyrender's maximum number of lights of each type; raycam has no limit."""
TARGET_OPEN_GL_MAJOR, TARGET_OPEN_GL_MINOR = 4, 1
MIN_OPEN_GL_MAJOR, MIN_OPEN_GL_MINOR = 3, 3
"""OpenGL versions that pyrender requires; raycam does not use OpenGL."""
FLOAT_SZ, UINT_SZ = 4, 4
SHADOW_TEX_SZ, TEXT_PADDING = 2048, 20
"""Sizes in pixels of pyrender's shadow maps and text margins; unused, because shadows are exact."""


class RenderFlags:
    """Flags of `OffscreenRenderer.render`, combined with `|`."""

    NONE = 0
    DEPTH_ONLY = 1
    OFFSCREEN = 2
    FLIP_WIREFRAME = 4
    ALL_WIREFRAME = 8
    ALL_SOLID = 16
    SHADOWS_DIRECTIONAL = 32
    SHADOWS_POINT = 64
    SHADOWS_SPOT = 128
    SHADOWS_ALL = 32 | 64 | 128
    VERTEX_NORMALS = 256
    FACE_NORMALS = 512
    SKIP_CULL_FACES = 1024
    RGBA = 2048
    FLAT = 4096
    SEG = 8192


class BufFlags:
    """Flags of a primitive's arrays, for `Primitive.buf_flags`."""

    POSITION = 0
    NORMAL = 1
    TANGENT = 2
    TEXCOORD_0 = 4
    TEXCOORD_1 = 8
    COLOR_0 = 16
    JOINTS_0 = 32
    WEIGHTS_0 = 64


class TexFlags:
    """Flags of a material's textures, for `Material.tex_flags`."""

    NONE = 0
    NORMAL = 1
    OCCLUSION = 2
    EMISSIVE = 4
    BASE_COLOR = 8
    METALLIC_ROUGHNESS = 16
    DIFFUSE = 32
    SPECULAR_GLOSSINESS = 64


class ProgramFlags:
    """The kinds of pyrender's shader programs, which are not used."""

    NONE = 0
    USE_MATERIAL = 1
    VERTEX_NORMALS = 2
    FACE_NORMALS = 4


class TextAlign:
    """Alignments of text, which is not rendered."""

    CENTER = 0
    CENTER_LEFT = 1
    CENTER_RIGHT = 2
    BOTTOM_LEFT = 3
    BOTTOM_RIGHT = 4
    BOTTOM_CENTER = 5
    TOP_LEFT = 6
    TOP_RIGHT = 7
    TOP_CENTER = 8


class GLTF:
    """Numbers of glTF 2.0 (and of OpenGL)."""

    NEAREST = 9728
    LINEAR = 9729
    NEAREST_MIPMAP_NEAREST = 9984
    LINEAR_MIPMAP_NEAREST = 9985
    NEAREST_MIPMAP_LINEAR = 9986
    LINEAR_MIPMAP_LINEAR = 9987
    CLAMP_TO_EDGE = 33071
    MIRRORED_REPEAT = 33648
    REPEAT = 10497
    POINTS = 0
    LINES = 1
    LINE_LOOP = 2
    LINE_STRIP = 3
    TRIANGLES = 4
    TRIANGLE_STRIP = 5
    TRIANGLE_FAN = 6
