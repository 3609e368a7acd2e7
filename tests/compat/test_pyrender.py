"""The stand-in for pyrender: common calls, and images compared with pyrender's formulas."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.compat import pyrender
from support.raises import raises, warns

trimesh = pytest.importorskip("trimesh")

BACK = np.eye(4)
BACK[2, 3] = 3.0
K = np.array([[60.0, 0, 31.4], [0, 62.0, 24.2], [0, 0, 1]])
SIZE = (64, 48)


def shifted(x: float, y: float = 0.0, z: float = 0.0) -> Any:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def camera() -> Any:
    return pyrender.IntrinsicsCamera(fx=K[0, 0], fy=K[1, 1], cx=K[0, 2], cy=K[1, 2], znear=0.01, zfar=10.0)


def scene(**options: Any) -> tuple[Any, Any]:
    made = pyrender.Scene(bg_color=[0, 0, 0, 0], ambient_light=(0.3, 0.3, 0.3), **options)
    box = trimesh.creation.box((1, 1, 1))
    node = made.add(pyrender.Mesh.from_trimesh(box, smooth=False), pose=np.eye(4), name="a")
    made.add(camera(), pose=BACK)
    made.add(pyrender.DirectionalLight(color=np.ones(3), intensity=3.0), pose=BACK)
    return made, node


def test_depth_is_measured_at_pixel_centres_and_follows_poses() -> None:
    made, node = scene()
    renderer = pyrender.OffscreenRenderer(viewport_width=SIZE[0], viewport_height=SIZE[1], point_size=1.0)
    color, depth = renderer.render(made)
    assert (color.shape, color.dtype, depth.shape, depth.dtype) == (
        (48, 64, 3),
        np.uint8,
        (48, 64),
        np.float32,
    )
    rows, columns = np.mgrid[0:48, 0:64] + 0.5
    x, y = (columns - K[0, 2]) / K[0, 0] * 2.5, (rows - K[1, 2]) / K[1, 1] * 2.5
    inside = (np.abs(x) < 0.5) & (np.abs(y) < 0.5)
    assert np.array_equal(depth > 0, inside)
    assert (depth[inside] == 2.5).all()
    made.set_pose(node, pose=shifted(0.2, 0.1, -1.0))
    moved = renderer.render(made, flags=pyrender.RenderFlags.DEPTH_ONLY)
    x, y = x / 2.5 * 3.5, y / 2.5 * 3.5
    front = (np.abs(x - 0.2) < 0.5) & (np.abs(-y - 0.1) < 0.5)
    assert (moved[front] == 3.5).all()
    # A scene whose first image is rendered after the change has the same depth.
    again, other = scene()
    other.matrix = shifted(0.2, 0.1, -1.0)
    fresh = pyrender.OffscreenRenderer(*SIZE).render(again)
    assert np.array_equal(fresh[1], moved)
    assert np.array_equal(fresh[0], renderer.render(made)[0])
    renderer.delete()
    renderer.delete()


def test_face_lit_by_a_directional_light_has_the_brightness_of_the_formula() -> None:
    for metallic, roughness, base, ambient in (
        (0.0, 0.5, [0.6, 0.3, 0.1], 0.0),
        (0.7, 0.3, [0.2, 0.8, 0.4], 0.2),
    ):
        material = pyrender.MetallicRoughnessMaterial(
            baseColorFactor=[*base, 1.0], metallicFactor=metallic, roughnessFactor=roughness
        )
        made = pyrender.Scene(bg_color=[0.0, 0.0, 0.0], ambient_light=ambient)
        made.add(pyrender.Mesh.from_trimesh(trimesh.creation.box((4, 4, 1)), material=material, smooth=False))
        made.add(pyrender.PerspectiveCamera(yfov=0.02), pose=BACK)
        made.add(pyrender.DirectionalLight(color=[1.0, 0.5, 0.25], intensity=2.0), pose=BACK)
        color, _ = pyrender.OffscreenRenderer(3, 3).render(made)
        # The surface is seen and lit along its normal: n.l = n.v = n.h = 1, the Fresnel term is f0, and masking is 1.
        rgb, sun = np.array(base), 2 * np.array([1.0, 0.5, 0.25])
        f0 = 0.04 * (1 - metallic) + rgb * metallic
        lambert = (1 - f0) * rgb * (1 - 0.04) * (1 - metallic) / np.pi
        peak = 1 / (np.pi * roughness**4)
        expected = 255 * np.clip(sun * (lambert + f0 * peak / 4.001) + rgb * ambient, 0, 1) ** (1 / 2.2)
        assert np.abs(color[1, 1] - expected).max() <= 1


def test_segmentation_shows_only_nodes_of_the_map() -> None:
    made, first = scene()
    second = made.add(
        pyrender.Mesh.from_trimesh(trimesh.creation.box((0.4, 0.4, 0.4))), pose=shifted(0, 0, 0.8)
    )
    third = made.add(pyrender.Mesh.from_trimesh(trimesh.creation.box((9, 9, 0.1))), pose=shifted(0, 0, 1.5))
    renderer = pyrender.OffscreenRenderer(*SIZE)
    flags = pyrender.RenderFlags
    seg, depth = renderer.render(made, flags.SEG, {first: 1, second: (300, 7, 0)})
    assert set(map(tuple, seg.reshape(-1, 3))) == {(0, 0, 0), (1, 1, 1), (255, 7, 0)}
    assert depth[24, 31] == 2.0
    nobody, nothing = renderer.render(made, flags.SEG)
    assert not nobody.any()
    assert not nothing.any()
    for node in made.mesh_nodes:
        node.mesh.is_visible = node is first
    assert renderer.render(made, flags=flags.DEPTH_ONLY)[24, 31] == 2.5
    made.remove_node(third)
    assert third not in made.nodes
    for node in made.mesh_nodes:
        node.mesh.is_visible = True
    assert renderer.render(made, flags=flags.DEPTH_ONLY)[24, 31] == 2.0


def test_back_faces_are_culled_and_clipping_planes_apply() -> None:
    flags = pyrender.RenderFlags
    for sides, flag, expected in ((False, 0, 3.5), (True, 0, 2.5), (False, flags.SKIP_CULL_FACES, 2.5)):
        material = pyrender.MetallicRoughnessMaterial(doubleSided=sides)
        turned = trimesh.creation.box((1, 1, 1))
        turned.invert()
        made = pyrender.Scene()
        made.add(pyrender.Mesh.from_trimesh(turned, material=material))
        made.add(camera(), pose=BACK)
        assert pyrender.OffscreenRenderer(*SIZE).render(made, flag)[1][24, 31] == expected
    made, _ = scene()
    near = pyrender.PerspectiveCamera(yfov=0.7, znear=2.6, zfar=3.4)
    made.main_camera_node = made.add(near, pose=BACK)
    _, depth = pyrender.OffscreenRenderer(*SIZE).render(made, flags.SKIP_CULL_FACES)
    assert depth[24, 31] == 0  # the back face at 3.5 is beyond the far plane
    near.zfar = None
    _, depth = pyrender.OffscreenRenderer(*SIZE).render(made, flags.SKIP_CULL_FACES)
    assert depth[24, 31] == 3.5


def test_colors_background_and_alpha_equal_pyrender() -> None:
    flags = pyrender.RenderFlags
    with warns(raycam.Notice, code="implausible", mentions=["255"]):  # integer colours are divided by 255
        made = pyrender.Scene(bg_color=[1, 1, 1, 0])
    made.add(camera(), pose=BACK)
    color, _ = pyrender.OffscreenRenderer(*SIZE).render(made, flags.RGBA)
    assert (color == [1, 1, 1, 0]).all()
    assert pyrender.Scene().bg_color.tolist() == [1, 1, 1, 1]
    assert pyrender.Scene(ambient_light=0.5).ambient_light.tolist() == [0.5] * 3
    box = trimesh.creation.box((1, 1, 1))
    box.visual.vertex_colors = np.tile([[200, 100, 50, 255]], (8, 1))
    made = pyrender.Scene(bg_color=[0.0, 0.0, 0.0, 0.0])
    made.add(pyrender.Mesh.from_trimesh(box))
    made.add(camera(), pose=BACK)
    color, _ = pyrender.OffscreenRenderer(*SIZE).render(made, flags.FLAT | flags.RGBA)
    assert color[24, 31].tolist() == [200, 100, 50, 255]
    glass = pyrender.MetallicRoughnessMaterial(baseColorFactor=[1.0, 0.0, 0.0, 0.5], alphaMode="BLEND")
    made.add(
        pyrender.Mesh.from_trimesh(trimesh.creation.box((3, 3, 0.1)), material=glass), pose=shifted(0, 0, 1)
    )
    color, depth = pyrender.OffscreenRenderer(*SIZE).render(made, flags.FLAT)
    # The back face is culled, so one layer of half-transparent red covers the box.
    assert np.abs(color[24, 31].astype(int) - [228, 50, 25]).max() <= 1
    assert depth[24, 31] == np.float32(1.95)
    box.visual = trimesh.visual.ColorVisuals(box, face_colors=np.tile([[0, 255, 0, 255]], (12, 1)))
    with raises(ValueError, mentions=["smooth=False"]):
        pyrender.Mesh.from_trimesh(box)
    assert pyrender.Mesh.from_trimesh(box, smooth=False).primitives[0].color_0.shape == (36, 4)


def test_spot_light_cone_and_shadows_have_the_expected_size() -> None:
    flags = pyrender.RenderFlags
    made = pyrender.Scene(bg_color=[0.0, 0.0, 0.0])
    made.add(
        pyrender.Mesh.from_trimesh(trimesh.creation.box((4, 4, 0.2)), smooth=False), pose=shifted(0, 0, -1.1)
    )
    made.add(
        pyrender.Mesh.from_trimesh(trimesh.creation.box((0.5, 0.5, 0.5)), smooth=False),
        pose=shifted(-0.5, 0, 1),
    )
    made.add(camera(), pose=BACK)
    lamp = made.add(pyrender.PointLight(intensity=20.0), pose=shifted(-0.5, 0, 3))
    renderer = pyrender.OffscreenRenderer(*SIZE)
    bright = renderer.render(made)[0]
    dark = renderer.render(made, flags.SHADOWS_POINT)[0]
    assert np.array_equal(renderer.render(made, flags.SHADOWS_DIRECTIONAL)[0], bright)
    assert (dark <= bright).all()
    assert 20 < (dark < bright).any(axis=-1).sum() < 600
    made.remove_node(lamp)
    spot = pyrender.SpotLight(intensity=20.0, innerConeAngle=0.1, outerConeAngle=0.2)
    made.add(spot, pose=shifted(1, 0, 3))
    lit = renderer.render(made)[0].max(axis=-1) > 40
    # A circle of radius 4 tan 0.2 on the floor, at distance 4 from lamp and camera.
    _, columns = np.nonzero(lit)
    radius = 60 * np.tan(0.2)
    assert np.abs(np.mean(columns) + 0.5 - (31.5 + 60 / 4)) < 2
    assert (columns.max() - columns.min()) / 2 <= radius + 1


def test_scene_graph_poses_names_and_errors_equal_pyrender() -> None:
    made, node = scene()
    below = made.add(
        pyrender.Mesh.from_trimesh(trimesh.creation.icosphere()), parent_name="a", pose=shifted(1)
    )
    node.translation = [0, 2, 0]
    node.rotation = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]
    node.scale = 2.0
    assert np.allclose(made.get_pose(below)[:3, 3], [0, 4, 0])
    assert np.allclose(node.rotation, [0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    assert np.allclose(node.scale, 2)
    assert made.get_nodes(name="a") == {node}
    assert np.allclose(made.bounds[1], made.bounds[0] + made.extents)
    made.remove_node(node)
    assert not made.has_node(below)
    with raises(ValueError, mentions=["'a'"]):
        made.set_pose(node, np.eye(4))
    with pytest.raises(TypeError):
        made.add("box")
    with pytest.raises(TypeError):
        pyrender.Mesh.from_trimesh(trimesh.Scene())
    made.clear()
    with raises(ValueError, mentions=["scene.add("]):
        pyrender.OffscreenRenderer(4, 4).render(made)
    lights = pyrender.Viewer._create_raymond_lights(pyrender.Viewer)
    assert len(lights) == 3
    eye = made.add(camera())
    for light in lights:
        made.add_node(light, parent_node=eye)
        assert np.allclose(light.matrix[:3, :3].T @ light.matrix[:3, :3], np.eye(3))
    assert made.light_nodes == set(lights)
    parts = trimesh.Scene({"a": trimesh.creation.box(), "b": trimesh.creation.icosphere()})
    assert len(pyrender.Scene.from_trimesh_scene(parts, ambient_light=np.full(3, 0.1)).mesh_nodes) == 2


def test_point_clouds_textures_instances_and_orthographic_cameras_are_rendered() -> None:
    flags = pyrender.RenderFlags
    points = np.array([[0, 0, 0], [0.5, 0, 0], [0, 0.5, -1.0]])
    made = pyrender.Scene(bg_color=[0.0, 0.0, 0.0])
    made.add(pyrender.Mesh.from_points(points, colors=np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])))
    made.add(pyrender.OrthographicCamera(xmag=1.0, ymag=1.0), pose=BACK)
    color, depth = pyrender.OffscreenRenderer(20, 20, point_size=3).render(made, flags.FLAT)
    assert (depth > 0).sum() == 27
    assert color[10, 15].tolist() == [0, 255, 0]
    assert depth[5, 10] == 4.0
    texels = np.zeros((2, 2, 3), np.uint8)
    texels[0] = [255, 0, 0]  # the upper row, at v = 1
    quad = trimesh.Trimesh(
        [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]], process=False
    )
    image = trimesh.visual.material.SimpleMaterial(
        image=Image.fromarray(texels), diffuse=[255, 255, 255, 255]
    )
    quad.visual = trimesh.visual.TextureVisuals(uv=[[0, 0], [1, 0], [1, 1], [0, 1]], material=image)
    made = pyrender.Scene(bg_color=[0.0, 0.0, 0.0])
    poses = np.stack([shifted(-1, 0, 0), shifted(1.5, 0, -1)])
    made.add(pyrender.Mesh.from_trimesh(quad, poses=poses))
    made.add(pyrender.OrthographicCamera(xmag=3.0, ymag=3.0), pose=BACK)
    color, depth = pyrender.OffscreenRenderer(60, 60).render(made, flags.FLAT)
    assert color[24, 20, 0] > 230  # near the middle of the upper texel
    assert color[35, 20, 0] < 25
    assert (depth[30, 20], depth[30, 45]) == (3, 4)


def test_code_that_imports_pyrender_uses_raycam_between_install_and_uninstall() -> None:
    code = """
import raycam.compat.pyrender as ours
ours.install()
import pyrender
from pyrender.constants import RenderFlags
from pyrender.camera import IntrinsicsCamera
import pyrender.utils
assert pyrender.constants.RenderFlags.FLAT == RenderFlags.FLAT
assert pyrender.IntrinsicsCamera is IntrinsicsCamera
assert pyrender.utils.format_color_vector([255, 0, 0], 4).tolist() == [1, 0, 0, 1]
ours.uninstall()
try:
    import pyrender
    raise SystemExit("still there")
except ImportError:
    print("good")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "good", done.stderr


def test_camera_matrices_equal_those_of_raycam() -> None:
    """The stand-in's depth equals the channel `depth` of a camera with the same K."""
    made, _ = scene()
    made.add(pyrender.Mesh.from_trimesh(trimesh.creation.icosphere(2, 0.4)), pose=shifted(0.7, -0.2, 0.3))
    _, depth = pyrender.OffscreenRenderer(*SIZE).render(made, pyrender.RenderFlags.SKIP_CULL_FACES)
    world = raycam.World("y")
    ball = trimesh.creation.icosphere(2, 0.4), shifted(0.7, -0.2, 0.3)
    for mesh, pose in ((trimesh.creation.box((1, 1, 1)), np.eye(4)), ball):
        world.add_mesh(mesh.vertices, mesh.faces, matrix=pose)
    seen = raycam.Camera.from_opengl(K, BACK, SIZE, pixel_center="half", up="y")
    expected = raycam.render(world, seen, channels="depth")["depth"]
    assert np.allclose(np.where(np.isfinite(expected), expected, 0), depth, rtol=1e-6)


def test_path_traced_matte_square_has_the_closed_form_brightness_and_shadows(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = pyrender.Scene(bg_color=[0.0, 0.0, 1.0, 1.0], ambient_light=[0.0, 0.0, 0.0])
    matte = pyrender.MetallicRoughnessMaterial(
        baseColorFactor=[0.5, 0.25, 1.0, 1.0], metallicFactor=0.0, roughnessFactor=1.0
    )
    square = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    faces = [[0, 1, 2], [0, 2, 3]]
    made.add(pyrender.Mesh([pyrender.Primitive(square, indices=faces, material=matte)]), name="square")
    # The blind shades the left half: the light comes from the upper left at 45 degrees.
    blind = pyrender.Primitive(
        [[-1.5, -2, 1], [-1, -2, 1], [-1, 2, 1], [-1.5, 2, 1]], indices=faces, material=matte
    )
    made.add(pyrender.Mesh([blind]))
    made.add(camera(), pose=BACK)
    tilt = np.eye(4)
    tilt[:3, :3] = [[np.sqrt(0.5), 0, -np.sqrt(0.5)], [0, 1, 0], [np.sqrt(0.5), 0, np.sqrt(0.5)]]
    made.add(pyrender.DirectionalLight(color=np.ones(3), intensity=3.0), pose=tilt)
    monkeypatch.setattr(pyrender, "shading", "raycam")
    color, depth = pyrender.OffscreenRenderer(*SIZE).render(made)
    assert depth[24, 31] == 3.0
    assert tuple(color[2, 31]) == (0, 0, 255)  # the background is unchanged
    linear = (color[24, 40] / 255.0) ** 2.2
    lit = 3.0 * np.sqrt(0.5) / np.pi * np.array([0.5, 0.25, 1.0])
    more = linear - lit  # the specular reflection of a rough dielectric, equal in all channels
    assert (more > 0.005).all()
    assert (more < 0.02).all()
    assert color[24, 24].max() < 60  # the shadow is lit only by the back of the blind
    flat = pyrender.OffscreenRenderer(*SIZE).render(made, pyrender.RenderFlags.FLAT)[0]
    assert np.abs(flat[24, 40].astype(int) - [128, 64, 255]).max() <= 1
    monkeypatch.setattr(pyrender, "shading", "blender")
    with raises(ValueError, mentions=['"pyrender"', '"raycam"']):
        pyrender.OffscreenRenderer(*SIZE).render(made)


def test_path_traced_scene_supports_textures_lights_and_instances(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pyrender, "shading", "raycam")
    made = pyrender.Scene(bg_color=[0.0] * 4, ambient_light=[1.0, 1.0, 1.0])
    image = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], np.uint8)
    paint = pyrender.MetallicRoughnessMaterial(
        baseColorTexture=pyrender.Texture(
            source=image, source_channels="RGB", sampler=pyrender.Sampler(magFilter=pyrender.GLTF.NEAREST)
        ),
        metallicFactor=0.0,
        roughnessFactor=1.0,
    )
    square = [[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]]
    primitive = pyrender.Primitive(
        square,
        indices=[[0, 1, 2], [0, 2, 3]],
        texcoord_0=[[0, 0], [1, 0], [1, 1], [0, 1]],
        material=paint,
        poses=[shifted(-0.6), shifted(0.6)],
    )
    made.add(pyrender.Mesh([primitive]))
    made.add(camera(), pose=BACK)
    made.add(pyrender.PointLight(intensity=0.0), pose=BACK)
    made.add(pyrender.SpotLight(intensity=0.0), pose=BACK)
    color, depth = pyrender.OffscreenRenderer(*SIZE).render(made, pyrender.RenderFlags.RGBA)
    for middle in (-0.6, 0.6):
        columns = (np.array([middle - 0.25, middle + 0.25]) / 3 * K[0, 0] + K[0, 2]).astype(int)
        rows = (np.array([-0.25, 0.25]) / 3 * K[1, 1] + K[1, 2]).astype(int)
        seen = color[rows[:, np.newaxis], columns]
        assert (seen[..., 3] == 255).all()
        strong = seen[..., :3] > 150
        assert (strong == (image > 0)).all()
    assert (depth > 0).any()
    assert color[0, 0, 3] == 0
    made.add(pyrender.OrthographicCamera(1, 1), pose=BACK, name="parallel")
    made.main_camera_node = next(iter(made.get_nodes(name="parallel")))
    with raises(NotImplementedError, mentions=['"raycam"']):
        pyrender.OffscreenRenderer(*SIZE).render(made)
