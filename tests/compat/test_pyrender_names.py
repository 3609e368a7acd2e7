"""The public names of pyrender 0.1.45, and the share of them in raycam.compat.pyrender."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from raycam.compat import pyrender
from support.raises import fault, raises

NAMES = {
    "camera.Camera": "name znear zfar get_projection_matrix",
    "camera.PerspectiveCamera": "yfov zfar aspectRatio get_projection_matrix",
    "camera.OrthographicCamera": "xmag ymag znear get_projection_matrix",
    "camera.IntrinsicsCamera": "fx fy cx cy get_projection_matrix",
    "constants": (
        "DEFAULT_Z_NEAR DEFAULT_Z_FAR DEFAULT_SCENE_SCALE MAX_N_LIGHTS TARGET_OPEN_GL_MAJOR "
        "TARGET_OPEN_GL_MINOR MIN_OPEN_GL_MAJOR MIN_OPEN_GL_MINOR FLOAT_SZ UINT_SZ SHADOW_TEX_SZ "
        "TEXT_PADDING GLTF"
    ),
    "constants.RenderFlags": (
        "NONE DEPTH_ONLY OFFSCREEN FLIP_WIREFRAME ALL_WIREFRAME ALL_SOLID SHADOWS_DIRECTIONAL "
        "SHADOWS_POINT SHADOWS_SPOT SHADOWS_ALL VERTEX_NORMALS FACE_NORMALS SKIP_CULL_FACES RGBA FLAT SEG"
    ),
    "constants.TextAlign": (
        "CENTER CENTER_LEFT CENTER_RIGHT BOTTOM_LEFT BOTTOM_RIGHT BOTTOM_CENTER TOP_LEFT TOP_RIGHT TOP_CENTER"
    ),
    "constants.GLTF": (
        "NEAREST LINEAR NEAREST_MIPMAP_NEAREST LINEAR_MIPMAP_NEAREST NEAREST_MIPMAP_LINEAR "
        "LINEAR_MIPMAP_LINEAR CLAMP_TO_EDGE MIRRORED_REPEAT REPEAT POINTS LINES LINE_LOOP LINE_STRIP "
        "TRIANGLES TRIANGLE_STRIP TRIANGLE_FAN"
    ),
    "constants.BufFlags": "POSITION NORMAL TANGENT TEXCOORD_0 TEXCOORD_1 COLOR_0 JOINTS_0 WEIGHTS_0",
    "constants.TexFlags": (
        "NONE NORMAL OCCLUSION EMISSIVE BASE_COLOR METALLIC_ROUGHNESS DIFFUSE SPECULAR_GLOSSINESS"
    ),
    "constants.ProgramFlags": "NONE USE_MATERIAL VERTEX_NORMALS FACE_NORMALS",
    "light.Light": "name color intensity shadow_texture",
    "light.DirectionalLight": "",
    "light.PointLight": "range",
    "light.SpotLight": "innerConeAngle outerConeAngle range",
    "material.Material": (
        "name normalTexture occlusionTexture emissiveTexture emissiveFactor alphaMode alphaCutoff "
        "doubleSided smooth wireframe is_transparent tex_flags textures"
    ),
    "material.MetallicRoughnessMaterial": (
        "baseColorFactor baseColorTexture metallicFactor roughnessFactor metallicRoughnessTexture"
    ),
    "material.SpecularGlossinessMaterial": (
        "diffuseFactor diffuseTexture specularFactor glossinessFactor specularGlossinessTexture"
    ),
    "mesh.Mesh": (
        "name primitives weights is_visible bounds centroid extents scale is_transparent from_points "
        "from_trimesh"
    ),
    "node.Node": "name camera children skin mesh light rotation translation scale matrix",
    "offscreen.OffscreenRenderer": "viewport_width viewport_height point_size render delete",
    "primitive.Primitive": (
        "positions normals tangents texcoord_0 texcoord_1 color_0 joints_0 weights_0 indices material "
        "mode targets poses bounds centroid extents scale buf_flags delete is_transparent"
    ),
    "sampler.Sampler": "name magFilter minFilter wrapS wrapT",
    "scene.Scene": (
        "name nodes bg_color ambient_light meshes mesh_nodes lights light_nodes point_lights "
        "point_light_nodes spot_lights spot_light_nodes directional_lights directional_light_nodes "
        "cameras camera_nodes main_camera_node bounds centroid extents scale add get_nodes add_node "
        "has_node remove_node get_pose set_pose clear from_trimesh_scene"
    ),
    "texture.Texture": (
        "name sampler source source_channels width height tex_type data_format is_transparent delete"
    ),
    "utils": "format_color_vector format_color_array format_texture_source",
    "viewer.Viewer": (
        "scene viewport_size render_lock is_active run_in_thread render_flags viewer_flags "
        "registered_keys close_external save_gif on_close on_draw on_resize on_mouse_press on_mouse_drag "
        "on_mouse_release on_mouse_scroll on_key_press"
    ),
}
"""Public names by module and class. The renderer, fonts, shaders and trackball of pyrender are not public."""
NOT_THERE = {
    "material.SpecularGlossinessMaterial": "MetallicRoughnessMaterial",
    "viewer.Viewer": "run_in_thread",
}
"""Classes whose names raise an error, and a word of the alternative in the error."""


def examples() -> dict[str, Any]:
    primitive = pyrender.Primitive(np.eye(3))
    light = pyrender.SpotLight()
    return {
        "IntrinsicsCamera": pyrender.IntrinsicsCamera(1, 1, 1, 1),
        "OrthographicCamera": pyrender.OrthographicCamera(1, 1),
        "PerspectiveCamera": pyrender.PerspectiveCamera(1),
        **dict.fromkeys(("Light", "DirectionalLight", "PointLight", "SpotLight"), light),
        "Material": pyrender.MetallicRoughnessMaterial(),
        "MetallicRoughnessMaterial": pyrender.MetallicRoughnessMaterial(),
        "Mesh": pyrender.Mesh([primitive]),
        "Node": pyrender.Node(),
        "OffscreenRenderer": pyrender.OffscreenRenderer(4, 4),
        "Primitive": primitive,
        "Sampler": pyrender.Sampler(),
        "Scene": pyrender.Scene(),
        "Texture": pyrender.Texture(source=np.zeros((2, 2, 3), np.uint8)),
    }


def viewer() -> Any:
    """A constructed viewer that serves no page."""
    made = pyrender.Viewer.__new__(pyrender.Viewer)
    made.scene, made.viewport_size, made.run_in_thread = pyrender.Scene(), (640, 480), False
    made.render_flags, made.viewer_flags, made.registered_keys, made.render_lock = {}, {}, {}, None
    return made


def test_at_least_93_percent_of_pyrenders_names_exist() -> None:
    pyrender.install()
    try:
        modules = {key: importlib.import_module(f"pyrender.{key.split('.')[0]}") for key in NAMES}
    finally:
        pyrender.uninstall()
    made, there, missing = examples() | {"Viewer": viewer()}, 0, []
    for key, text in NAMES.items():
        kind = key.partition(".")[2]
        owner = getattr(modules[key], kind) if kind else modules[key]
        names = text.split()
        there += bool(kind) and kind != "SpecularGlossinessMaterial"
        for name in names:
            if hasattr(owner, name) or hasattr(made.get(kind), name):
                there += 1
                continue
            missing.append(f"{key}.{name}")
            assert key in NOT_THERE, missing
    share = there / (there + len(missing))
    assert share >= 0.93, (share, missing)


def test_missing_names_raise_with_an_alternative() -> None:
    for name in ("on_draw", "on_mouse_drag"):
        with raises(AttributeError, mentions=["run_in_thread"]):
            getattr(viewer(), name)
    with raises(NotImplementedError, mentions=["MetallicRoughnessMaterial"]):
        pyrender.material.SpecularGlossinessMaterial(diffuseFactor=[1, 1, 1])
    for call in (pyrender.Renderer(4, 4).read_color_buf, pyrender.Renderer(4, 4).read_depth_buf):
        with raises(NotImplementedError, mentions=["render("]):
            call()
    pyrender.install()
    try:
        for module, word in (
            ("font", fault(None, "PIL")),
            ("shader_program", fault(None, '"raycam"')),
            ("trackball", fault(None, "look_at")),
        ):
            found = importlib.import_module(f"pyrender.{module}")
            with raises(ImportError, **word):
                _ = found.Anything
            assert not hasattr(found, "__path__")
    finally:
        pyrender.uninstall()


def test_material_and_primitive_flags_list_their_textures_and_attributes() -> None:
    flags = pyrender.constants.BufFlags, pyrender.constants.TexFlags
    image = np.zeros((2, 2, 3), np.uint8)
    material = pyrender.MetallicRoughnessMaterial(normalTexture=image, baseColorTexture=image)
    assert material.tex_flags == flags[1].NORMAL | flags[1].BASE_COLOR
    primitive = pyrender.Primitive(
        np.eye(3), normals=np.eye(3), texcoord_0=np.zeros((3, 2)), color_0=np.ones((3, 4))
    )
    assert primitive.buf_flags == flags[0].NORMAL | flags[0].TEXCOORD_0 | flags[0].COLOR_0
