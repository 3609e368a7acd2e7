"""Values of the stand-in for pyrender.

Image bytes are compared with recordings from pyrender 0.1.45; conversions and the viewer are checked, too.
"""

from __future__ import annotations

import urllib.request
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.compat import pyrender
from support.patience import until
from support.raises import raises, warns

trimesh = pytest.importorskip("trimesh")

flags = pyrender.RenderFlags
Material = pyrender.MetallicRoughnessMaterial


def placed(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def square(**options: Any) -> Any:
    """A square of side 2 in front of the camera."""
    corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    options = {
        "normals": np.tile([0, 0, 1.0], (4, 1)),
        "texcoord_0": [[0, 0], [1, 0], [1, 1], [0, 1]],
    } | options
    return pyrender.Mesh([pyrender.Primitive(corners, indices=[[0, 1, 2], [0, 2, 3]], **options)])


def middle(
    mesh: Any, *, sun: float = 0.0, ambient: float = 0.0, flag: int = 0, turned: Any = None
) -> list[int]:
    """The middle pixel of an image of a mesh from (0, 0, 3)."""
    scene = pyrender.Scene(ambient_light=[ambient] * 3)
    scene.add(mesh, pose=turned)
    scene.add(pyrender.PerspectiveCamera(yfov=1.0), pose=placed(z=3))
    if sun:
        scene.add(pyrender.DirectionalLight(intensity=sun), pose=placed(z=3))
    color = pyrender.OffscreenRenderer(9, 9).render(scene, flag)[0]
    return [int(value) for value in color[4, 4]]


def gamma(linear: float) -> int:
    return round(255 * min(linear, 1.0) ** (1 / 2.2))


def lambert(base: float, metallic: float, ambient: float = 0.0) -> float:
    """The default shader's value for a light of 3 and roughness 1.

    The directions to the light and to the viewer equal the normal.
    """
    f0 = 0.04 * (1 - metallic) + base * metallic
    diffuse = (1 - f0) * base * 0.96 * (1 - metallic) / np.pi
    return 3 * (diffuse + f0 / np.pi / 4.001) + base * ambient


def test_default_materials_equal_those_of_pyrender() -> None:
    assert middle(square(), sun=3) == [gamma(lambert(1.0, 1.0))] * 3
    grey = trimesh.Trimesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0.0]], [[0, 1, 2]])
    made = pyrender.Mesh.from_trimesh(grey)
    material = made.primitives[0].material
    assert (material.metallicFactor, material.roughnessFactor, material.alphaMode) == (0.2, 0.8, "BLEND")
    assert np.allclose(material.baseColorFactor, [0.3, 0.3, 0.3, 1])
    assert not made.is_transparent
    # A given material replaces the colours, and is copied.
    colored = trimesh.Trimesh(grey.vertices, grey.faces, vertex_colors=[[255, 0, 0, 255]] * 3)
    given = Material(baseColorFactor=[0.5, 0.5, 0.5], metallicFactor=0.0)
    shown = pyrender.Mesh.from_trimesh(colored, material=given)
    given.baseColorFactor = [1.0, 0, 0]
    assert middle(shown, sun=3) == [gamma(lambert(0.5, 0.0))] * 3
    # trimesh's SimpleMaterial is converted to metal.
    visual = trimesh.visual.TextureVisuals(
        uv=np.zeros((3, 2)),
        material=trimesh.visual.material.SimpleMaterial(diffuse=[102, 102, 102, 255], Ns=0.0),
    )
    simple = trimesh.Trimesh(grey.vertices, grey.faces, visual=visual, process=False)
    assert middle(pyrender.Mesh.from_trimesh(simple), sun=3) == [gamma(lambert(0.4, 1.0))] * 3


def test_occlusion_roughness_normal_and_color_textures_equal_pyrender() -> None:
    image = np.full((2, 2, 3), [128, 60, 200], np.uint8)
    linear = [((value / 255 + 0.055) / 1.055) ** 2.4 for value in (128, 60, 200)]
    seen = middle(square(material=Material(baseColorTexture=image)), ambient=1.0)
    assert seen == [gamma(value) for value in linear]
    assert middle(square(material=Material(baseColorTexture=image)), flag=flags.FLAT) == [128, 60, 200]
    black = [0.0, 0, 0, 1]
    shining = Material(baseColorFactor=black, emissiveFactor=[0.5, 1.0, 0], emissiveTexture=image)
    assert middle(square(material=shining)) == [gamma(0.25 * linear[0]), gamma(linear[1]), 0]
    occluded = Material(occlusionTexture=np.full((4, 4), 51, np.uint8))
    assert middle(square(material=occluded), ambient=1.0) == [gamma(0.2)] * 3
    # pyrender takes roughness and metalness from the channels G and B of an image, but R and G of a `Texture`.
    rough = np.full((4, 4, 3), [0, 255, 0], np.uint8)
    sources = (rough, pyrender.Texture(source=rough[..., [1, 0, 0]], source_channels="RGB"))
    for source in sources:
        metal = Material(metallicRoughnessTexture=source, baseColorFactor=[0.5, 0.5, 0.5])
        assert middle(square(material=metal), sun=3) == [gamma(lambert(0.5, 0.0))] * 3
    # A surface whose normal is bent by 60 degrees to +u, lit from there, is as bright as a flat surface lit from
    # the front.
    bent = np.rint(127.5 * (1 + np.array([np.sqrt(0.75), 0, 0.5]))).astype(np.uint8)
    tilted = Material(
        normalTexture=np.tile(bent, (4, 4, 1)), baseColorFactor=[0.5, 0.5, 0.5], metallicFactor=0.0
    )
    scene = pyrender.Scene()
    scene.add(square(material=tilted))
    scene.add(pyrender.PerspectiveCamera(yfov=1.0), pose=placed(z=3))
    turn = trimesh.transformations.rotation_matrix(np.radians(60), [0, 1, 0])
    sun = scene.add(pyrender.DirectionalLight(intensity=3.0), pose=turn)
    straight = pyrender.OffscreenRenderer(9, 9).render(scene)[0][4, 4, 0]
    scene.set_pose(sun, np.linalg.inv(turn))
    away = pyrender.OffscreenRenderer(9, 9).render(scene)[0][4, 4, 0]
    assert straight > 170
    assert away < 20


def test_alpha_is_blended_as_in_opengl() -> None:
    half = Material(alphaMode="BLEND", baseColorFactor=[1.0, 0, 0, 0.5])
    assert middle(square(material=half), ambient=1.0, flag=flags.RGBA) == [255, 128, 128, 191]
    opaque = Material(alphaMode="OPAQUE", baseColorFactor=[1.0, 0, 0, 0.5])
    assert middle(square(material=opaque), ambient=1.0, flag=flags.RGBA) == [255, 0, 0, 128]
    assert square(material=half).is_transparent
    assert not square(material=Material(alphaMode="BLEND")).is_transparent


def test_points_and_faces_without_normals_face_the_camera() -> None:
    cloud = pyrender.Mesh.from_points([[0, 0, 0.0]], colors=[[0.5, 1.0, 0.25]])
    white = lambert(1.0, 1.0)
    assert middle(cloud) == [0, 0, 0]
    assert middle(cloud, sun=3) == [gamma(white * share) for share in (0.5, 1.0, 0.25)]
    turned = trimesh.transformations.rotation_matrix(0.6, [0, 1, 0])
    plain = square(normals=None, material=Material(metallicFactor=0.0, baseColorFactor=[0.5, 0.5, 0.5]))
    assert middle(plain, sun=3, turned=turned) == [gamma(lambert(0.5, 0.0))] * 3


def test_lines_wireframes_strips_and_fans_are_rendered() -> None:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [-1, 1, 0], [1, 1, 0.0]])

    def covered(primitive: Any, flag: int = 0, **options: Any) -> Any:
        scene = pyrender.Scene(ambient_light=[1.0] * 3, bg_color=[0.0] * 3, **options)
        scene.add(pyrender.Mesh([primitive]))
        scene.add(pyrender.OrthographicCamera(xmag=2.0, ymag=2.0), pose=placed(z=3))
        return pyrender.OffscreenRenderer(40, 40).render(scene, flag)

    whole = covered(pyrender.Primitive(corners, mode=pyrender.GLTF.TRIANGLE_STRIP))
    fan = covered(pyrender.Primitive(corners[[0, 1, 3, 2]], mode=pyrender.GLTF.TRIANGLE_FAN))
    assert (whole[1] == 3).sum() == 400
    assert np.array_equal(whole[0], fan[0])
    line = pyrender.Primitive([[-1, 0.05, 1], [1, 0.05, 0]], mode=pyrender.GLTF.LINES)
    color, depth = covered(line)
    assert (np.flatnonzero(depth[19]) == np.arange(10, 30)).all()
    assert np.allclose(depth[19, 10:30], 2 + (np.arange(20) + 0.5) / 20, atol=1e-6)
    assert color[19, 15].tolist() == [255, 255, 255]
    wired = pyrender.Primitive(corners, indices=[[0, 1, 3], [0, 3, 2]], material=Material(wireframe=True))
    edges = covered(wired)[1] > 0
    assert 90 <= edges.sum() <= 110
    assert not edges[24:28, 23:28].any()
    assert (covered(wired, flags.FLIP_WIREFRAME)[1] > 0).sum() == 400
    assert (covered(wired, flags.DEPTH_ONLY) > 0).sum() == 400
    plain = pyrender.Primitive(corners, indices=[[0, 1, 3], [0, 3, 2]])
    assert np.array_equal(covered(plain, flags.ALL_WIREFRAME)[1] > 0, edges)
    blue = covered(pyrender.Primitive([[-1, -1, 0], [1, -1, 0], [0, 1, 0.3]]), flags.FACE_NORMALS)[0]
    assert (blue == [0, 0, 255]).all(axis=2).any()
    loop = covered(pyrender.Primitive(corners[[0, 1, 3, 2]], mode=pyrender.GLTF.LINE_LOOP))[1] > 0
    assert 76 <= loop.sum() <= 84


def test_attributes_are_converted_and_checked() -> None:
    material = Material()
    material.baseColorFactor = [255, 0, 0]
    assert material.baseColorFactor.tolist() == [1, 0, 0, 1]
    light = pyrender.PointLight()
    light.color = [0, 255, 0]
    assert light.color.dtype == np.float32
    for holder, name, value in (
        (material, "metallicFactor", 1.5),
        (material, "alphaMode", "GLASS"),
        (light, "range", -1),
        (pyrender.PerspectiveCamera(1.0), "yfov", 0),
        (pyrender.OrthographicCamera(1, 1), "ymag", -1),
    ):
        with raises(ValueError, mentions=[name]):
            setattr(holder, name, value)
    with raises(TypeError, mentions=["doubleSided"]):
        material.doubleSided = 1
    with raises(TypeError, mentions=["Mesh"]):
        pyrender.Node().mesh = trimesh.creation.box()
    with raises(ValueError, mentions=["[2, 3]"]):
        pyrender.Primitive(np.zeros((3, 3)), normals=np.zeros((2, 3)))
    with raises(ValueError, mentions=["TRIANGLE_FAN"]):
        pyrender.Primitive(np.zeros((3, 3)), mode=9)
    with raises(ValueError, mentions=["aspectRatio"]):
        pyrender.PerspectiveCamera(1.0).get_projection_matrix()
    with raises(ValueError, mentions=["channels"]):
        pyrender.Texture(source=np.zeros((2, 2, 3)), source_channels="BGR")
    wide = pyrender.OrthographicCamera(xmag=1.5, ymag=2.0)
    assert wide.get_projection_matrix(width=64, height=48)[0, 0] == 0.375
    assert wide.get_projection_matrix()[0, 0] == 1 / 1.5
    node = pyrender.Node(translation=[1, 2, 3])
    pose = node.matrix
    pose[0, 3] = 9
    assert node.translation.tolist() == [1, 2, 3], "the matrix is a copy, as in pyrender"
    scene = pyrender.Scene(nodes=[pyrender.Node(light=light), pyrender.Node(light=pyrender.SpotLight())])
    assert scene.point_lights == {light}
    assert len(scene.spot_lights) == 1
    assert scene.directional_lights == set()


def test_images_become_textures_with_the_requested_channels() -> None:
    form = pyrender.utils.format_texture_source
    image = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
    assert form(None) is None
    assert form(image, "GB").tolist() == image[..., 1:].tolist()
    assert form(image / 255.0, "R").shape == (2, 2)
    assert form(image, "RGBA")[..., 3].tolist() == [[255, 255], [255, 255]]
    assert form(Image.fromarray(image).convert("P"), "RGB").shape == (2, 2, 3)
    with raises(ValueError, mentions=["2 channels"]):
        form(image[..., :2], "RGB")
    with raises(TypeError, mentions=["[h, w]"]):
        form("brick.png")


def test_viewer_opens_the_live_view_and_follows_the_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("raycam.viewer.view.open_browser", lambda *_: False)
    scene = pyrender.Scene()
    node = scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.icosphere(1)))
    with warns(raycam.Notice, code="unused_option", mentions=["registered_keys"]):
        viewer = pyrender.Viewer(
            scene,
            viewport_size=(64, 48),
            use_raymond_lighting=True,
            run_in_thread=True,
            rotate=True,
            registered_keys={"a": print},
        )
    try:
        assert viewer.is_active
        assert viewer._view.camera.size == (64, 48)
        assert len(viewer._view.world.lights) == 4  # the viewer's three suns and the ambient light
        with urllib.request.urlopen(viewer._view.url) as page:
            assert page.status == 200
        with viewer.render_lock:
            scene.set_pose(node, placed(2))
        until(lambda: viewer._view.world.objects[0].matrix[0, 3] == 2)
    finally:
        viewer.close_external()
    assert not viewer.is_active
    with raises(NotImplementedError, mentions=["raycam.video.write_video"]):
        viewer.save_gif()


def test_integer_colors_in_0_to_1_give_a_notice() -> None:
    with warns(raycam.Notice, code="implausible", mentions=["[1, 1", "255"]):
        light = pyrender.DirectionalLight(color=[1, 1, 1])
    assert light.color.tolist() == [np.float32(1 / 255)] * 3
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for color in ([0, 0, 0], [255, 1, 0], [1.0, 1, 0], np.ones(3)):
            pyrender.PointLight(color=color)


def test_mesh_of_another_library_is_refused_with_an_alternative() -> None:
    @dataclass
    class Arrays:
        vertices: Any
        faces: Any

    with raises(TypeError, mentions=["indices=faces"]):
        pyrender.Mesh.from_trimesh(Arrays(np.zeros((3, 3)), [[0, 1, 2]]))


def test_values_assigned_to_elements_of_node_arrays_change_the_matrix() -> None:
    node = pyrender.Node(translation=[1, 2, 3], scale=[2, 2, 2])
    node.translation[0] = 5
    node.translation[1:] += 1
    node.scale[2] = 4
    np.testing.assert_allclose(node.matrix, [[2, 0, 0, 5], [0, 2, 0, 3], [0, 0, 4, 4], [0, 0, 0, 1]])
    node.rotation[:] = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]
    np.testing.assert_allclose(node.matrix[:3, 0], [0, 2, 0], atol=1e-12)
    with raises(ValueError, mentions=["rotation"]):
        node.rotation[0] = 3
    with raises(ValueError, mentions=["translation"]):
        node.translation[0] = np.nan
    np.testing.assert_allclose(node.matrix[:3, 0], [0, 2, 0], atol=1e-12)


def test_assignments_through_views_move_the_node_and_other_writes_are_refused() -> None:
    node = pyrender.Node(translation=[1, 2, 3])
    view = node.translation[1:]
    view[0] = 9
    kept = node.translation
    kept += 1
    np.testing.assert_array_equal(node.matrix[:3, 3], [2, 10, 4])
    apart = node.translation * 2
    apart[0] = 7
    apart.fill(3)
    for change in (lambda: node.translation.fill(1), lambda: np.copyto(node.scale, 2)):
        with raises(ValueError):
            change()
    np.testing.assert_array_equal(node.matrix[:3, 3], [2, 10, 4])


@pytest.mark.parametrize("scale", [[2, 3, 4], [-2, 3, 4], [-1, -1, -1], [1, 1, -2]])
def test_rotation_and_scale_of_a_node_compose_its_matrix(scale: list[float]) -> None:
    turn = [0.5, 0.5, -0.5, 0.5]
    made = pyrender.Node(rotation=turn, scale=scale)
    np.testing.assert_array_equal(made.scale, scale)
    read = pyrender.Node(matrix=made.matrix)
    np.testing.assert_allclose(
        pyrender.Node(rotation=read.rotation, scale=read.scale).matrix, made.matrix, atol=1e-12
    )
    read.scale = np.array(read.scale) * 2
    np.testing.assert_allclose(read.matrix[:3, :3], 2 * made.matrix[:3, :3], atol=1e-12)
    made.scale = 0
    made.scale = scale
    np.testing.assert_allclose(made.matrix, pyrender.Node(rotation=turn, scale=scale).matrix)
    with raises(ValueError, mentions=["scale"]):
        made.scale = [1, np.nan, 1]


def test_node_translation_keeps_a_mirroring_matrix() -> None:
    node = pyrender.Node(matrix=np.diag([-1.0, 1, 1, 1]))
    node.translation = [1, 2, 3]
    np.testing.assert_allclose(node.matrix, [[-1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])


def test_assigned_clipping_planes_of_a_camera_are_checked() -> None:
    camera = pyrender.PerspectiveCamera(yfov=1.0, znear=0.1, zfar=10)
    for name, value in (("znear", 20), ("zfar", 0.05), ("znear", 10)):
        with raises(ValueError, mentions=[name]):
            setattr(camera, name, value)
    assert (camera.znear, camera.zfar) == (0.1, 10)
    camera.zfar = None
    camera.znear = 20
    assert camera.znear == 20


def test_scene_accepts_nodes_with_their_children() -> None:
    leaf = pyrender.Node(name="leaf", translation=[0, 0, 1])
    branch = pyrender.Node(name="branch", children=[leaf], translation=[0, 1, 0])
    root = pyrender.Node(name="root", children=[branch], translation=[1, 0, 0])
    for nodes in ([root, branch, leaf], [leaf, branch, root], [root], [leaf, root]):
        scene = pyrender.Scene(nodes=nodes)
        assert scene.nodes == {root, branch, leaf}
        np.testing.assert_allclose(scene.get_pose(leaf)[:3, 3], [1, 1, 1])
    branch.children.append(root)
    with raises(ValueError, mentions=["'root'"]):
        pyrender.Scene(nodes=[root, branch])


def test_point_cloud_without_points_renders_the_background() -> None:
    scene = pyrender.Scene(bg_color=[0, 0, 0])
    points: Any
    for points in ([], np.zeros((0, 3))):
        scene.add(pyrender.Mesh.from_points(points, colors=np.zeros((0, 3))))
    scene.add(pyrender.PerspectiveCamera(yfov=1.0))
    color, depth = pyrender.OffscreenRenderer(16, 12).render(scene)
    assert (color.max(), depth.max()) == (0, 0)


@pytest.mark.parametrize("color", [[255, 0, 0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 1.0], [[1.0, 0.0, 0.0]]])
def test_single_color_applies_to_all_points(color: object) -> None:
    mesh = pyrender.Mesh.from_points(np.eye(3), colors=color)  # type: ignore[arg-type]
    np.testing.assert_array_equal(
        mesh.primitives[0].color_0, np.tile(np.array([1, 0, 0, 1], np.float32), (3, 1))
    )


def test_points_and_colors_of_the_wrong_shape_are_refused() -> None:
    points = np.zeros((6, 3))
    for positions, colors, name in (
        (np.zeros((4, 2)), None, "positions"),
        (points, np.ones((4, 3)), "[6, 4]"),
    ):
        with raises(ValueError, mentions=[name]):
            pyrender.Mesh.from_points(positions, colors=colors)
    assert pyrender.Mesh.from_points([1.0, 2, 3]).primitives[0].positions.shape == (1, 3)


def test_private_renderer_attribute_raises_with_the_channel_to_use() -> None:
    with raises(AttributeError, mentions=["normal"]):
        _ = pyrender.OffscreenRenderer(4, 3)._renderer


@pytest.mark.parametrize("mirror", [[-1, 1, 1], [1, -1, 1], [1, 1, -1], [-1, -1, -1]])
def test_mirrored_pose_shows_front_faces(mirror: list[int]) -> None:
    """A negative determinant reverses the winding (glTF 2.0, 3.7.4).

    A box mirrored at its own symmetry planes is the same box.
    """
    box = pyrender.Mesh.from_trimesh(trimesh.creation.box(), smooth=False)
    pictures = []
    for pose in (np.eye(4), np.diag([*mirror, 1.0])):
        scene = pyrender.Scene(ambient_light=[0.2] * 3)
        scene.add(box, pose=pose)
        view = np.eye(4)
        view[2, 3] = 2
        scene.add(pyrender.PerspectiveCamera(yfov=1.0), pose=view)
        scene.add(pyrender.DirectionalLight(intensity=2), pose=view)
        pictures.append(pyrender.OffscreenRenderer(32, 24).render(scene))
    np.testing.assert_array_equal(pictures[1][1], pictures[0][1])
    np.testing.assert_array_equal(pictures[1][0], pictures[0][0])


def test_second_image_looks_up_each_instance_of_a_mesh_only_once(monkeypatch: pytest.MonkeyPatch) -> None:
    from raycam.compat.pyrender.picture import instances

    calls: list[int] = []
    key = instances.Instance.key

    def counted(self: instances.Instance) -> tuple[int, int, int]:
        calls.append(1)
        return key(self)

    monkeypatch.setattr(instances.Instance, "key", counted)
    poses = np.tile(np.eye(4), (300, 1, 1))
    poses[:, 0, 3] = np.arange(300)
    scene = pyrender.Scene()
    scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.box(), poses=poses))
    scene.add(pyrender.PerspectiveCamera(yfov=1.0))
    renderer = pyrender.OffscreenRenderer(8, 6)
    renderer.render(scene)
    renderer.render(scene)
    assert len(calls) == 300, len(calls)


@pytest.mark.parametrize("show", ["faces", "points", "lines", "wireframe", "normals", "see-through"])
def test_poses_of_a_primitive_show_the_same_as_nodes(show: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from raycam.compat.pyrender.picture import fragments

    monkeypatch.setattr(fragments, "MAX_VERTICES", 200)
    ball = trimesh.creation.icosphere(1, 0.3)
    poses = np.array([placed(x, y, -0.7 * x) for x in (-1.2, 0, 1.2) for y in (-0.8, 0.5)])
    poses[1, :3, :3] = np.diag([-1, 1.5, 1])
    colors = np.linspace(0.2, 1, 4 * len(ball.vertices)).reshape(-1, 4)

    def mesh(poses: Any = None) -> Any:
        if show in ("points", "lines"):
            mode = 0 if show == "points" else 1
            return pyrender.Mesh([pyrender.Primitive(ball.vertices, mode=mode, color_0=colors, poses=poses)])
        alpha = 0.5 if show == "see-through" else 1.0
        material = Material(baseColorFactor=[0.6, 0.5, 0.4, alpha], alphaMode="BLEND")
        return pyrender.Mesh.from_trimesh(ball, material, poses=poses, wireframe=show == "wireframe")

    flag = flags.VERTEX_NORMALS | flags.FACE_NORMALS if show == "normals" else 0
    pictures = []
    for each in ([(mesh(poses), np.eye(4))], [(mesh(), pose) for pose in poses]):
        scene = pyrender.Scene(ambient_light=[0.2] * 3)
        for shown, pose in each:
            scene.add(shown, pose=pose)
        scene.add(pyrender.PerspectiveCamera(yfov=1.0), pose=placed(z=3))
        scene.add(pyrender.DirectionalLight(intensity=3), pose=placed(z=3))
        pictures.append(pyrender.OffscreenRenderer(64, 48).render(scene, flag))
    # The lengths of normals depend on the size of the primitive at all its poses.
    if show != "normals":
        np.testing.assert_array_equal(pictures[0][1], pictures[1][1])
        np.testing.assert_allclose(pictures[0][0].astype(int), pictures[1][0], atol=1)
    assert (pictures[0][1] > 0).sum() > 100


@pytest.mark.parametrize("mode", [0, 1, 4])
def test_singular_pose_renders_normals_without_an_error(mode: int) -> None:
    """A pose that flattens z leaves a square in the plane z = 0, which faces the camera."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    shown = pyrender.Primitive(corners, normals=np.tile([0, 0, 1.0], (6, 1)), mode=mode)
    shown.material.wireframe = True
    scene = pyrender.Scene(ambient_light=[1.0] * 3)
    scene.add(pyrender.Mesh([shown]), pose=np.diag([1, 1, 0, 1.0]))
    scene.add(pyrender.PerspectiveCamera(yfov=1.0), pose=placed(z=3))
    depth = pyrender.OffscreenRenderer(31, 31).render(scene)[1]
    np.testing.assert_allclose(np.unique(depth), [0, 3])


def test_image_computes_the_bounds_of_a_primitive_at_most_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[int] = []
    bounds = pyrender.Primitive.bounds.fget

    def counted(self: Any) -> Any:
        calls.append(1)
        return bounds(self)

    monkeypatch.setattr(pyrender.Primitive, "bounds", property(counted))
    poses = np.tile(np.eye(4), (40, 1, 1))
    scene = pyrender.Scene()
    scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.box(), poses=poses))
    scene.add(pyrender.PerspectiveCamera(yfov=1.0), pose=placed(z=3))
    for flag in (0, flags.VERTEX_NORMALS):
        calls.clear()
        pyrender.OffscreenRenderer(8, 6).render(scene, flag)
        assert len(calls) <= 1, flag


# What pyrender 0.1.45 does when these values are assigned; `None` marks the values that it accepts.
ASSIGNED = [
    (lambda: pyrender.OrthographicCamera(1, 1), "xmag", None, TypeError),
    (lambda: pyrender.OrthographicCamera(1, 1), "ymag", None, TypeError),
    (lambda: pyrender.OrthographicCamera(1, 1), "znear", None, TypeError),
    (lambda: pyrender.OrthographicCamera(1, 1), "znear", 0.0, ValueError),
    (lambda: pyrender.OrthographicCamera(1, 1), "zfar", None, TypeError),
    (lambda: pyrender.OrthographicCamera(1, 1), "zfar", 0.01, ValueError),
    (lambda: pyrender.IntrinsicsCamera(9, 9, 4, 3), "zfar", None, TypeError),
    (lambda: pyrender.IntrinsicsCamera(9, 9, 4, 3), "fx", None, TypeError),
    (lambda: pyrender.IntrinsicsCamera(9, 9, 4, 3), "cx", None, TypeError),
    (lambda: pyrender.PerspectiveCamera(1.0), "yfov", None, TypeError),
    (lambda: pyrender.PerspectiveCamera(1.0), "znear", None, TypeError),
    (lambda: pyrender.PerspectiveCamera(1.0), "znear", 0, None),
    (lambda: pyrender.PerspectiveCamera(1.0), "zfar", None, None),
    (lambda: pyrender.PerspectiveCamera(1.0), "aspectRatio", None, None),
    (pyrender.DirectionalLight, "color", None, ValueError),
    (pyrender.DirectionalLight, "intensity", None, TypeError),
    (pyrender.PointLight, "range", None, None),
    (pyrender.SpotLight, "innerConeAngle", -1.0, ValueError),
    (pyrender.SpotLight, "innerConeAngle", np.pi / 3, ValueError),
    (pyrender.SpotLight, "outerConeAngle", -1.0, ValueError),
    (pyrender.SpotLight, "outerConeAngle", np.pi, ValueError),
    (pyrender.SpotLight, "outerConeAngle", np.pi / 2, None),
    (lambda: pyrender.Primitive(np.zeros((3, 3))), "texcoord_1", np.zeros(10), ValueError),
    (lambda: pyrender.Primitive(np.zeros((3, 3))), "texcoord_0", np.zeros(10), ValueError),
]


@pytest.mark.parametrize(("make", "name", "value", "error"), ASSIGNED)
def test_assigned_values_are_refused_as_in_pyrender(make: Any, name: str, value: Any, error: Any) -> None:
    holder = make()
    before = getattr(holder, name)
    if error is None:
        setattr(holder, name, value)
        assert getattr(holder, name) == value
        return
    with pytest.raises(error):
        setattr(holder, name, value)
    assert getattr(holder, name) is before
