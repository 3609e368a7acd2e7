"""glTF files, read: each test builds a small document and knows what must come of it."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
import trimesh
from gltf_document import SQUARE, SQUARE_CORNERS, SQUARE_UVS, TRIANGLE, Document
from PIL import Image
from scipy.spatial.transform import Rotation

DATA = Path(__file__).parent / "data" / "gltf"


def load(document: Document, path: Path, **keys: Any) -> raycam.World:
    return raycam.load(document.save(path / "model.glb"), **keys)


def png(pixels: Any, **keys: Any) -> bytes:
    file = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(file, "PNG", **keys)
    return file.getvalue()


def seen(world: raycam.World, *, size: int = 8, **keys: Any) -> Any:
    """The base colours of the square from -1 to 1, as bytes [size, size, 3], row 0 at its top."""
    camera = raycam.Camera.look_at([0, 0, 2], [0, 0, 0], [0, 1, 0], size=(size, size), fov=2 * 26.5650512)
    frame = raycam.render(world, camera, integrator="flat", samples=1, **keys)
    return frame.to_srgb8()


# Accessors ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("normalized", [False, True])
@pytest.mark.parametrize("kind", ["int8", "uint8", "int16", "uint16", "float32"])
def test_components(tmp_path: Path, kind: str, normalized: bool) -> None:
    whole = kind != "float32"
    low = -128 if kind == "int8" else -32768 if kind == "int16" else 0
    high = np.iinfo(kind).max if whole else 1
    stored = np.array([[0, 0, 0], [high, 0, 5], [0, 100, low]], kind)
    document = Document()
    document.use("KHR_mesh_quantization", required=True)
    keys = {"normalized": True} if normalized and whole else {}
    stride = 4 if stored.itemsize == 1 else 8 if stored.itemsize == 2 else 0
    document.node(mesh=document.mesh({"POSITION": document.accessor(stored, stride=stride, **keys)}))
    expected = stored.astype(np.float64)
    if keys:
        expected = np.maximum(expected / high, -1)
    np.testing.assert_allclose(load(document, tmp_path).triangles()[0], expected, rtol=1e-7)


@pytest.mark.parametrize("kind", ["uint8", "uint16", "uint32", None])
def test_indices(tmp_path: Path, kind: str | None) -> None:
    document = Document()
    order = [2, 0, 3, 1, 3, 0]
    points = SQUARE if kind else SQUARE[order]
    document.node(mesh=document.mesh({"POSITION": points}, np.array(order, kind) if kind else None))
    np.testing.assert_array_equal(load(document, tmp_path).triangles().reshape(-1, 3), SQUARE[order])


def test_strided_and_interleaved(tmp_path: Path) -> None:
    document = Document()
    rows = np.zeros(4, [("position", "<f4", 3), ("uv", "<u2", 2), ("rest", "<u4")])
    rows["position"], rows["uv"], rows["rest"] = SQUARE, SQUARE_UVS * 65535, 0xDEADBEEF
    view = document.view(rows.tobytes(), byteStride=rows.itemsize)
    position = document.describe(SQUARE, bufferView=view)
    uv = document.describe(rows["uv"], bufferView=view, byteOffset=12, normalized=True)
    image = document.add("images", bufferView=document.view(png(ARROWS)), mimeType="image/png")
    texture = document.add("textures", source=image, sampler=document.add("samplers", magFilter=9728))
    color = {"baseColorTexture": {"index": texture}}
    material = document.add("materials", pbrMetallicRoughness=color)
    attributes = {"POSITION": position, "TEXCOORD_0": uv}
    document.node(mesh=document.mesh(attributes, SQUARE_CORNERS, material=material))
    world = load(document, tmp_path)
    np.testing.assert_array_equal(world.triangles().reshape(-1, 3), SQUARE[SQUARE_CORNERS])
    np.testing.assert_array_equal(seen(world, size=2), ARROWS)


ARROWS = [[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [90, 120, 33]]]


@pytest.mark.parametrize("based", [True, False])
def test_sparse(tmp_path: Path, based: bool) -> None:
    document = Document()
    indices = document.view(np.array([1, 3], np.uint16).tobytes())
    moved = np.array([[5, -1, 0], [-1, 7, 2]], np.float32)
    sparse = {
        "count": 2,
        "indices": {"bufferView": indices, "componentType": 5123},
        "values": {"bufferView": document.view(moved.tobytes())},
    }
    base = SQUARE if based else np.zeros_like(SQUARE)
    view = {"bufferView": document.view(SQUARE.tobytes())} if based else {}
    position = document.describe(base, sparse=sparse, **view)
    document.node(mesh=document.mesh({"POSITION": position}, SQUARE_CORNERS))
    expected = base.copy()
    expected[[1, 3]] = moved
    np.testing.assert_array_equal(
        load(document, tmp_path).triangles().reshape(-1, 3), expected[SQUARE_CORNERS]
    )


# Geometry -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("mode", "word"), [(0, "points"), (1, "lines"), (2, "lines"), (3, "lines")])
def test_what_has_no_surface_is_said(tmp_path: Path, mode: int, word: str) -> None:
    document = Document()
    document.node(mesh=document.mesh({"POSITION": SQUARE}, mode=mode))
    document.node(mesh=document.square())
    world = load(document, tmp_path)
    assert world.counts["triangles"] == 2
    assert any(f"meshes[0].primitives[0]: {word} are not shown" in notice for notice in world.notices)


def test_strips_and_fans_keep_their_winding(tmp_path: Path) -> None:
    angles = np.linspace(0, np.pi, 6)
    rim = np.stack([np.cos(angles), np.sin(angles), 0 * angles], 1)
    fan = np.concatenate([[[0, 0, 0]], rim]).astype(np.float32)
    ladder = np.array([[i // 2, i % 2, 0] for i in range(7)], np.float32)
    for mode, points, area in ((6, fan, 2.5 * np.sin(np.pi / 5)), (5, ladder[:, [0, 1, 2]], 2.5)):
        document = Document()
        document.node(mesh=document.mesh({"POSITION": points}, mode=mode))
        corners = load(document, tmp_path).triangles()
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        # All turn the same way, and cover the whole once.
        sign = 1 if mode == 6 else -1
        assert (sign * normals[:, 2] > 0).all()
        np.testing.assert_allclose(sign * normals[:, 2].sum() / 2, area, rtol=1e-6)


@pytest.mark.parametrize("scale", [[1, 1, 1], [-1, 1, 1], [-1, -1, -1], [2, 1, -3]])
def test_negative_scale_keeps_the_outside_outside(tmp_path: Path, scale: list[float]) -> None:
    box = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    document = Document()
    points = np.asarray(box.vertices, np.float32)
    mesh = document.mesh(
        {"POSITION": points, "NORMAL": points / np.linalg.norm(points, axis=1, keepdims=True)},
        np.asarray(box.faces, np.uint16).ravel(),
        # Single-sided: what is inside out would not be seen.
        material=document.add("materials", pbrMetallicRoughness={"baseColorFactor": [1, 0, 0, 1]}),
    )
    document.node(mesh=mesh, scale=scale)
    world = load(document, tmp_path)
    camera = raycam.Camera.look_at([0, 0, 6], [0, 0, 0], [0, 1, 0], size=(32, 32), fov=20)
    frame = raycam.render(world, camera, channels=["color", "instance", "shading_normal"], samples=4)
    hit = frame["instance"] >= 0
    assert hit.sum() > 50
    assert (frame["color"][hit][:, 0] > 0.02).all(), "seen, and lit from outside"
    # Normals are those of the ellipsoid that the scale makes of the sphere.
    pixels = np.argwhere(hit)[:, ::-1].astype(float)
    origins, ways = camera.rays(pixels)
    found = world.cast_rays(origins, ways)
    truth = found["position"] / np.square(scale)
    truth /= np.linalg.norm(truth, axis=1, keepdims=True)
    shown = frame["shading_normal"][hit]
    assert np.median((truth * shown).sum(1)) > 0.995


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_scale_of_zero_along_one_axis_leaves_a_flat_mesh(tmp_path: Path, axis: int, moving: bool) -> None:
    """Only where all three are zero may a mesh be left out (glTF 2.0, 3.5.3)."""
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=1)
    points = np.asarray(sphere.vertices, np.float32)
    document = Document()
    mesh = document.mesh(
        {"POSITION": points, "NORMAL": points}, np.asarray(sphere.faces, np.uint16).ravel(), material=0
    )
    document.add("materials", doubleSided=True)
    scale = np.where(np.arange(3) == axis, 0.0, 2.0)
    turn = Rotation.from_euler("xyz", [0.2, 0.3, 0.4])
    node = document.node(
        mesh=mesh, scale=[1, 1, 1] if moving else scale.tolist(), rotation=turn.as_quat().tolist()
    )
    document.node(mesh=mesh, scale=[0, 0, 2])  # a line: nothing to see
    if moving:
        animated(document, "scale", [0, 1], [[1, 1, 1], scale], node=node)
    world = load(document, tmp_path)
    assert len(world.objects) == (2 if moving else 1)
    assert any("a line or a point" in notice for notice in world.notices) != moving
    if moving:
        world = world.at(1)
    normal = turn.as_matrix()[:, axis]
    camera = raycam.Camera.look_at(3 * normal, [0, 0, 0], np.roll(normal, 1), size=(64, 64), fov=90)
    frame = raycam.render(world, camera, channels=["color", "depth", "normal", "shading_normal"], samples=1)
    hit = np.isfinite(frame["depth"])
    # A disc of radius 2, seen from 3 above: pixels of 6 / 64.
    assert abs(hit.sum() * (6 / 64) ** 2 / (4 * np.pi) - 1) < 0.01
    np.testing.assert_allclose(frame["depth"][hit], 3, rtol=1e-6)
    for channel in ("normal", "shading_normal"):
        np.testing.assert_allclose(frame[channel][hit] @ normal, 1, rtol=1e-5)
    assert (frame["color"][hit] > 0.05).all()


def test_the_tree_of_nodes(tmp_path: Path) -> None:
    turn, push = [0.1, -0.3, 0.2, 0.927], [1.0, 2.0, -3.0]
    rotation = Rotation.from_quat(turn)
    inner = np.array([[1, 0.2, 0, 4], [0, 2, 0, 5], [0, 0, -1, 6], [0, 0, 0, 1.0]])
    document = Document()
    child = document.node(
        mesh=document.mesh({"POSITION": TRIANGLE}), matrix=inner.T.ravel().tolist(), name="leaf"
    )
    parent = document.node(children=[child], translation=push, rotation=turn, scale=[2, 3, 4])
    document.json["scenes"] = [{"nodes": [parent]}]
    world = load(document, tmp_path)
    outer = np.eye(4)
    outer[:3, :3] = rotation.as_matrix() * [2, 3, 4]
    outer[:3, 3] = push
    assert world.up == "y"
    assert world.objects[0].name == "leaf"
    np.testing.assert_allclose(world.objects[0].matrix, outer @ inner, atol=1e-12)
    theirs = trimesh.load(tmp_path / "model.glb").to_geometry()
    # It turns the corners of what is mirrored the other way round.
    np.testing.assert_allclose(world.triangles()[0, ::-1], theirs.vertices[theirs.faces][0], atol=1e-6)


def test_instances(tmp_path: Path) -> None:
    places = np.array([[0, 0, 0], [3, 1, 0], [-2, 0, 5]], np.float32)
    turns = Rotation.from_euler("xyz", [[0, 0, 0], [90, 0, 0], [0, 30, 60]], degrees=True)
    scales = np.array([[1, 1, 1], [2, 1, 1], [1, 1, -3]], np.float32)
    document = Document()
    document.use("EXT_mesh_gpu_instancing", required=True)
    stored = np.round(turns.as_quat() * 32767).astype(np.int16)
    attributes = {
        "TRANSLATION": document.accessor(places),
        "ROTATION": document.accessor(stored, normalized=True),
        "SCALE": document.accessor(scales),
        "_ID": document.accessor(np.arange(3, dtype=np.float32)),
    }
    extension = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    document.node(mesh=document.mesh({"POSITION": TRIANGLE}), translation=[10, 0, 0], extensions=extension)
    world = load(document, tmp_path)
    assert world.counts["meshes"] == 1
    for i, thing in enumerate(world.objects):
        expected = np.eye(4)
        expected[:3, :3] = turns[i].as_matrix() * scales[i]
        expected[:3, 3] = places[i] + [10, 0, 0]
        np.testing.assert_allclose(thing.matrix, expected, atol=3e-4)
    assert any("_ID: not used" in notice for notice in world.notices)


def test_hidden_nodes_are_said(tmp_path: Path) -> None:
    document = Document()
    document.use("KHR_node_visibility")
    hidden = {"KHR_node_visibility": {"visible": False}}
    mesh = document.square()
    below = document.node(mesh=mesh, name="below")
    above = document.node(children=[below], extensions=hidden)
    shown = document.node(mesh=mesh, name="shown")
    document.json["scenes"] = [{"nodes": [above, shown]}]
    world = load(document, tmp_path)
    assert [thing.name for thing in world.objects] == ["shown"]
    assert any("nodes[0]: hidden" in notice for notice in world.notices)


def test_the_default_scene(tmp_path: Path) -> None:
    document = Document()
    mesh = document.square()
    first, second = document.node(mesh=mesh, name="first"), document.node(mesh=mesh, name="second")
    document.json |= {"scenes": [{"nodes": [first]}, {"nodes": [second]}], "scene": 1}
    world = load(document, tmp_path)
    assert [thing.name for thing in world.objects] == ["second"]
    assert any("scenes: number 1" in notice for notice in world.notices)


def test_compressed_geometry() -> None:
    box = raycam.load(DATA / "BoxDraco" / "BoxDraco.gltf")
    np.testing.assert_allclose(box.bounds, [[-0.5] * 3, [0.5] * 3], atol=1e-3)
    assert trimesh.Trimesh(*_merged(box)).volume == pytest.approx(1, abs=3e-3)
    for name in ("EXT", "KHR"):
        world = raycam.load(DATA / f"meshopt-{name}" / "meshopt-no-fallback.gltf")
        assert world.counts["triangles"] > 0
        assert np.isfinite(world.triangles()).all()


def _merged(world: raycam.World) -> tuple[Any, Any]:
    corners = world.triangles().reshape(-1, 3)
    return corners, np.arange(len(corners)).reshape(-1, 3)


# Cameras and lights ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("far", [{"zfar": 50.0}, {}], ids=["finite", "infinite"])
def test_perspective(tmp_path: Path, far: dict[str, float]) -> None:
    fov, aspect = 0.7, 1.5
    lens = {"yfov": fov, "aspectRatio": aspect, "znear": 0.1, **far}
    document = Document()
    document.add("cameras", type="perspective", perspective=lens, name="eye")
    turn = Rotation.from_euler("yx", [40, -20], degrees=True)
    # Scale has no meaning for cameras.
    document.node(camera=0, translation=[1, 2, 3], rotation=turn.as_quat().tolist(), scale=[2, 2, 2])
    world = load(document, tmp_path)
    camera = world.cameras["eye"]
    width, height = camera.size
    assert width / height == pytest.approx(aspect, rel=2e-3)
    np.testing.assert_allclose(camera.C, [1, 2, 3])
    # The corners of the image plane, as the specification's projection matrix has them.
    y = np.tan(fov / 2)
    x = y * width / height
    points = np.array([1, 2, 3]) + turn.apply([[-x, y, -1], [x, y, -1], [x, -y, -1], [0, 0, -5], [0, 0, 1]])
    pixels, in_front = camera.project(points)
    corners = [[0, 0], [width, 0], [width, height], [width / 2, height / 2]]
    np.testing.assert_allclose(pixels[:4] + 0.5, corners, atol=1e-6)
    assert in_front.tolist() == [True] * 4 + [False]


def test_orthographic_cameras_see_what_their_magnifications_say(tmp_path: Path) -> None:
    document = Document()
    lens = {"xmag": 3.0, "ymag": 1.5, "znear": 0.0, "zfar": 100.0}
    document.add("cameras", type="orthographic", orthographic=lens, name="plan")
    turn = Rotation.from_euler("xyz", [20, 30, 40], degrees=True)
    document.node(camera=0, translation=[1, 2, 3], rotation=turn.as_quat().tolist(), scale=[2, 2, 2])
    document.node(mesh=document.square())
    camera = load(document, tmp_path).cameras["plan"]
    width, height = camera.size
    assert camera.is_parallel
    assert width / height == pytest.approx(2, abs=0.01)
    # The corners of the box that it sees (glTF 2.0, 3.10.3), near and far, and one behind it.
    box = np.array([[-3, 1.5, -1], [3, 1.5, -7], [3, -1.5, -50], [-3, -1.5, -1], [0, 0, 1]])
    pixels, seen = camera.project(turn.apply(box) + np.array([1, 2, 3]))
    corners = [[0, 0], [width, 0], [width, height], [0, height]]
    np.testing.assert_allclose(pixels[:4] + 0.5, corners, atol=1e-6)
    assert seen.tolist() == [True] * 4 + [False]


def test_an_orthographic_camera_of_negative_magnification_gets_a_notice(tmp_path: Path) -> None:
    document = Document()
    lens = {"xmag": -1.0, "ymag": 1.0, "znear": 0.1, "zfar": 10.0}
    document.node(camera=document.add("cameras", type="orthographic", orthographic=lens))
    document.node(mesh=document.square())
    world = load(document, tmp_path)
    assert len(world.cameras) == 1
    assert any("CAMERA_XMAG_YMAG_NEGATIVE" in notice for notice in world.notices)


def test_lights(tmp_path: Path) -> None:
    document = Document()
    document.use("KHR_lights_punctual")
    lights = [
        {"type": "directional", "color": [1, 0.5, 0], "intensity": 3},
        {"type": "point", "intensity": 20, "range": 4},
        {"type": "spot", "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.6}},
    ]
    document.json["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    down = Rotation.from_euler("x", -90, degrees=True).as_quat().tolist()
    for i in range(3):
        extension = {"KHR_lights_punctual": {"light": i}}
        document.node(extensions=extension, rotation=down, translation=[0, i, 0], scale=[7, 7, 7])
    document.node(mesh=document.square())
    sun, bulb, spot = load(document, tmp_path).lights
    assert (sun["type"], bulb["type"], spot["type"]) == ("sun", "bulb", "spot")
    np.testing.assert_allclose(sun["direction"], [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(sun["irradiance"], [3, 1.5, 0])
    np.testing.assert_allclose((bulb["position"], bulb["intensity"]), ([0, 1, 0], [20] * 3))
    np.testing.assert_allclose([spot["inner"], spot["outer"]], np.degrees([0.2, 0.6]))
    np.testing.assert_allclose((spot["position"], spot["direction"]), ([0, 2, 0], [0, -1, 0]), atol=1e-12)
    world = load(document, tmp_path)
    assert any("range is a hint" in notice for notice in world.notices)


# Materials and textures -----------------------------------------------------------------------------------


def textured(document: Document, pixels: Any, info: dict[str, Any] | None = None, **keys: Any) -> None:
    """A square in nearest texels of this picture."""
    image = document.add("images", bufferView=document.view(png(pixels)), mimeType="image/png")
    sampler = {"magFilter": 9728, "minFilter": 9728, **keys.pop("sampler", {})}
    texture = document.add("textures", source=image, sampler=document.add("samplers", **sampler))
    color = {"baseColorTexture": {"index": texture, **(info or {})}}
    document.node(mesh=document.square(pbrMetallicRoughness=color, **keys))


def test_textures_are_srgb_and_upright(tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (8, 8, 3), np.uint8)
    document = Document()
    textured(document, pixels)
    np.testing.assert_array_equal(seen(load(document, tmp_path)), pixels)


@pytest.mark.parametrize(
    ("info", "matrix"),
    [
        ({"offset": [0.25, -0.125]}, [[1, 0, 0.25], [0, 1, -0.125]]),
        ({"scale": [2, -1]}, [[2, 0, 0], [0, -1, 0]]),
        ({"rotation": np.pi / 2}, [[0, 1, 0], [-1, 0, 0]]),
        ({"offset": [0.5, 0], "rotation": np.pi / 2, "scale": [2, 0.5]}, [[0, 0.5, 0.5], [-2, 0, 0]]),
    ],
)
def test_texture_transforms(tmp_path: Path, info: dict[str, Any], matrix: list[list[float]]) -> None:
    """Translation * rotation * scale of (u, v), as the extension writes it, and repeated."""
    pixels = np.random.default_rng(2).integers(0, 256, (8, 8, 3), np.uint8)
    document = Document()
    document.use("KHR_texture_transform")
    textured(document, pixels, {"extensions": {"KHR_texture_transform": info}})
    v, u = (np.mgrid[:16, :16] + 0.5) / 16
    u, v = np.moveaxis(np.stack([u, v, np.ones_like(u)], -1) @ np.transpose(matrix), -1, 0)
    column, row = (np.floor(8 * np.stack([u, v]) + 1e-6) % 8).astype(int)
    np.testing.assert_array_equal(seen(load(document, tmp_path), size=16), pixels[row, column])


@pytest.mark.parametrize(
    ("code", "columns"),
    [(10497, [0, 1, 0, 1, 0, 1]), (33071, [0, 0, 0, 1, 1, 1]), (33648, [1, 0, 0, 1, 1, 0])],
)
def test_wrap_modes(tmp_path: Path, code: int, columns: list[int]) -> None:
    pixels = np.array([[[255, 0, 0], [0, 0, 255]]], np.uint8)
    document = Document()
    document.use("KHR_texture_transform")
    info = {"extensions": {"KHR_texture_transform": {"scale": [3, 1], "offset": [-1, 0]}}}
    textured(document, pixels, info, sampler={"wrapS": code})
    np.testing.assert_array_equal(seen(load(document, tmp_path), size=6)[0], pixels[0, columns])


def test_the_transform_may_choose_other_coordinates(tmp_path: Path) -> None:
    document = Document()
    document.use("KHR_texture_transform")
    image = document.add("images", bufferView=document.view(png(ARROWS)), mimeType="image/png")
    texture = document.add("textures", source=image, sampler=document.add("samplers", magFilter=9728))
    info = {"index": texture, "texCoord": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1}}}
    material = document.add("materials", pbrMetallicRoughness={"baseColorTexture": info})
    attributes = {"POSITION": SQUARE, "TEXCOORD_0": SQUARE_UVS, "TEXCOORD_1": SQUARE_UVS[:, ::-1].copy()}
    document.node(mesh=document.mesh(attributes, SQUARE_CORNERS, material=material))
    turned = np.swapaxes(np.array(ARROWS), 0, 1)
    np.testing.assert_array_equal(seen(load(document, tmp_path), size=2), turned)


def test_images_beside_the_file_and_inside_the_text(tmp_path: Path) -> None:
    picture = png(ARROWS)
    (tmp_path / "a b.png").write_bytes(picture)
    inside = "data:image/png;base64," + base64.b64encode(picture).decode()
    for uri in ("a%20b.png", inside):
        document = Document()
        image = document.add("images", uri=uri)
        texture = document.add("textures", source=image, sampler=document.add("samplers", magFilter=9728))
        document.node(mesh=document.square(pbrMetallicRoughness={"baseColorTexture": {"index": texture}}))
        np.testing.assert_array_equal(seen(load(document, tmp_path), size=2), ARROWS)


def test_webp_goes_before_the_image_for_others(tmp_path: Path) -> None:
    file = io.BytesIO()
    Image.fromarray(np.array(ARROWS, np.uint8)).save(file, "WEBP", lossless=True)
    document = Document()
    document.use("EXT_texture_webp")
    other = document.add("images", bufferView=document.view(png(np.zeros((2, 2, 3)))), mimeType="image/png")
    image = document.add("images", bufferView=document.view(file.getvalue()), mimeType="image/webp")
    sampler = document.add("samplers", magFilter=9728)
    extensions = {"EXT_texture_webp": {"source": image}}
    texture = document.add("textures", source=other, sampler=sampler, extensions=extensions)
    document.node(mesh=document.square(pbrMetallicRoughness={"baseColorTexture": {"index": texture}}))
    np.testing.assert_array_equal(seen(load(document, tmp_path), size=2), ARROWS)


@pytest.mark.parametrize("kind", ["uint8", "uint16", "float32"])
@pytest.mark.parametrize("count", [3, 4])
def test_vertex_colors_are_linear(tmp_path: Path, kind: str, count: int) -> None:
    colors = np.array([[0, 0.5, 1], [1, 0.25, 0], [0.5, 0.5, 0.5]])
    colors = np.hstack([colors, [[0.25], [1], [0.5]]])[:, :count]
    high = 1 if kind == "float32" else np.iinfo(kind).max
    stored = np.round(colors * high, 0 if high > 1 else 9).astype(kind)
    document = Document()
    stride = {("uint8", 3): 4, ("uint16", 3): 8}.get((kind, count), 0)
    accessor = document.accessor(stored, stride=stride, **({"normalized": True} if high > 1 else {}))
    factor = {"baseColorFactor": [0.5, 1, 1, 1]}
    material = document.add("materials", pbrMetallicRoughness=factor)
    document.node(mesh=document.mesh({"POSITION": TRIANGLE, "COLOR_0": accessor}, material=material))
    world = load(document, tmp_path)
    expected = (stored[:, :3] / high).mean(0) * [0.5, 1, 1]
    np.testing.assert_allclose(world.triangle_colors()[0], expected, rtol=1e-6)


def test_alpha(tmp_path: Path) -> None:
    """A cut-out shows what is behind it, a blend mixes, opaque ignores alpha; the ground truth agrees."""
    pixels = np.zeros((2, 2, 4), np.uint8)
    pixels[..., 0], pixels[..., 3] = 255, [[0, 255], [100, 200]]
    shares = {"OPAQUE": [[1, 1], [1, 1]], "MASK": [[0, 1], [0, 1]], "BLEND": pixels[..., 3] / 255}
    for mode, share in shares.items():
        document = Document()
        document.use("KHR_materials_unlit")
        unlit = {"KHR_materials_unlit": {}}
        textured(document, pixels, alphaMode=mode, extensions=unlit)
        behind = {"baseColorFactor": [0, 0, 1, 1]}
        back = document.square(pbrMetallicRoughness=behind, extensions=unlit)
        document.node(mesh=back, translation=[0, 0, -0.5], scale=[2, 2, 1])
        world = load(document, tmp_path)
        camera = raycam.Camera.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0], size=(2, 2), fov=2 * 14.0362435)
        color = raycam.render(world, camera, samples=2048, integrator="path")["color"]
        np.testing.assert_allclose(color[..., 0], share, atol=0.05)
        np.testing.assert_allclose(color[..., 2], 1 - np.array(share), atol=0.05)


def test_single_and_double_sided(tmp_path: Path) -> None:
    for double in (False, True):
        document = Document()
        document.use("KHR_materials_unlit")
        mesh = document.square(doubleSided=double, extensions={"KHR_materials_unlit": {}})
        document.node(mesh=mesh, rotation=[0, 1, 0, 0])
        world = load(document, tmp_path)
        camera = raycam.Camera.look_at([0, 0, 2], [0, 0, 0], [0, 1, 0], size=(2, 2), fov=40)
        world.add_light(type="sky", radiance=[0.25, 0.5, 0])
        color = raycam.render(world, camera, samples=4)["color"]
        np.testing.assert_allclose(color, [[[1, 1, 1] if double else [0.25, 0.5, 0]] * 2] * 2, atol=1e-6)


def test_variants(tmp_path: Path) -> None:
    document = Document()
    document.use("KHR_materials_variants")
    names = {"red": [1, 0, 0, 1], "blue": [0, 0, 1, 1]}
    document.json["extensions"] = {"KHR_materials_variants": {"variants": [{"name": name} for name in names]}}
    colors = [document.add("materials", pbrMetallicRoughness={"baseColorFactor": c}) for c in names.values()]
    mesh = document.square(pbrMetallicRoughness={"baseColorFactor": [0, 1, 0, 1]})
    mappings = [{"material": material, "variants": [i]} for i, material in enumerate(colors)]
    extension = {"KHR_materials_variants": {"mappings": mappings}}
    document.json["meshes"][mesh]["primitives"][0]["extensions"] = extension
    document.node(mesh=mesh)
    world = load(document, tmp_path)
    assert world.variants == ["red", "blue"]
    np.testing.assert_allclose(world.triangle_colors()[0], [0, 1, 0])
    np.testing.assert_allclose(world.with_variant("blue").triangle_colors()[0], [0, 0, 1])
    np.testing.assert_allclose(load(document, tmp_path, variant="red").triangle_colors()[0], [1, 0, 0])
    with pytest.raises(raycam.WorldError, match=r"did you mean.*blue"):
        world.with_variant("bleu")


def test_emission_does_not_take_the_place_of_light(tmp_path: Path) -> None:
    """glTF's viewers light what has no lights; a lamp's screen in a file must not leave all else in the dark."""
    document = Document()
    document.use("KHR_materials_emissive_strength")
    glow = {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}
    document.node(mesh=document.square(emissiveFactor=[1, 0.5, 0], extensions=glow), translation=[-1, 0, 0])
    document.node(mesh=document.square(pbrMetallicRoughness={"metallicFactor": 0}), translation=[1, 0, 0])
    world = load(document, tmp_path)
    camera = raycam.Camera.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0], size=(4, 2), fov=30)
    for integrator in ("direct", "path"):
        frame = raycam.render(world, camera, integrator=integrator, samples=16)
        assert (frame["color"][:, 3] > 0.3).all(), "lit by what a world without lights gets"
        assert (frame["color"][:, 0] >= [3.9, 2, 0.1]).all(), "and shining by itself"
        assert any("no lights" in notice for notice in frame.notices)
    world.add_light(type="sky", radiance=[0, 0, 0])
    dark = raycam.render(world, camera, samples=16)["color"]
    assert (dark[:, 3] < 1e-3).all(), "unless it is given light, be it none"
    assert (dark[:, 0] > [3, 1.5, -1]).all()


# What is not there ----------------------------------------------------------------------------------------


def test_unknown_extensions(tmp_path: Path) -> None:
    document = Document()
    document.use("EXT_of_tomorrow")
    document.node(mesh=document.square())
    world = load(document, tmp_path)
    assert world.counts["triangles"] == 2
    assert any("EXT_of_tomorrow is not read, and not required" in notice for notice in world.notices)
    document.use("EXT_of_tomorrow", required=True)
    with pytest.raises(
        raycam.FormatError, match=r"extensionsRequired: EXT_of_tomorrow \(UNSUPPORTED_EXTENSION\)"
    ):
        load(document, tmp_path)


# Time -----------------------------------------------------------------------------------------------------


def animated(document: Document, path: str, times: Any, output: Any, *, node: int, **keys: Any) -> None:
    """An animation of one channel."""
    sampler = {
        "input": document.accessor(np.asarray(times, np.float32)),
        "output": document.accessor(np.asarray(output, np.float32)),
        **keys,
    }
    channel = {"sampler": 0, "target": {"node": node, "path": path}}
    document.add("animations", samplers=[sampler], channels=[channel], name=f"{path} of {node}")


def test_interpolation(tmp_path: Path) -> None:
    times, places = [1, 2, 4], np.array([[0, 0, 0], [4, 0, 0], [4, 8, 0]], np.float32)
    tangents = np.array([[1, 2, 3], [0, -1, 0], [2, 0, 0]], np.float32)
    spline = np.stack([tangents, places, -tangents], 1).reshape(-1, 3)
    document = Document()
    node = document.node(mesh=document.square())
    animated(document, "translation", times, places, node=node)
    animated(document, "translation", times, places, node=node, interpolation="STEP")
    animated(document, "translation", times, spline, node=node, interpolation="CUBICSPLINE")
    world = load(document, tmp_path)
    assert [animation.duration for animation in world.animations] == [4, 4, 4]

    def place(time: float, animation: int) -> Any:
        return world.at(time, animation).objects[0].matrix[:3, 3]

    np.testing.assert_allclose(
        [place(t, 0) for t in (0, 1.25, 3, 9)], [places[0], [1, 0, 0], [4, 4, 0], places[2]]
    )
    np.testing.assert_allclose([place(t, 1) for t in (0, 1.99, 2, 9)], places[[0, 0, 1, 2]])
    from scipy.interpolate import CubicHermiteSpline

    for first in (0, 1):
        # Each keyframe has its own tangent in and tangent out.
        ends = [-tangents[first], tangents[first + 1]]
        curve = CubicHermiteSpline(times[first : first + 2], places[first : first + 2], ends)
        for time in np.linspace(times[first], times[first + 1], 5):
            np.testing.assert_allclose(place(float(time), 2), curve(time), atol=1e-6)


def test_rotations_turn_evenly_the_short_way(tmp_path: Path) -> None:
    ends = Rotation.from_euler("zx", [[0, 0], [170, 40]], degrees=True)
    from scipy.spatial.transform import Slerp

    document = Document()
    node = document.node(mesh=document.square())
    # The second has the other sign: the same rotation, the long way round.
    animated(document, "rotation", [0, 1], ends.as_quat() * [[1], [-1]], node=node)
    world = load(document, tmp_path)
    for time in (0.0, 0.25, 0.5, 0.9, 1.0):
        turned = world.at(time).objects[0].matrix[:3, :3]
        np.testing.assert_allclose(turned, Slerp([0, 1], ends)(time).as_matrix(), atol=1e-6)


def test_morph_targets_and_skins(tmp_path: Path) -> None:
    up = np.array([[0, 0, 0], [0, 0, 1], [0, 2, 0]], np.float32)
    document = Document()
    mesh = document.mesh({"POSITION": TRIANGLE}, targets=[{"POSITION": document.accessor(up)}])
    document.json["meshes"][mesh]["weights"] = [0.5]
    node = document.node(mesh=mesh)
    animated(document, "weights", [0, 1], [0, 1], node=node)
    weights = np.array([[1, 0, 0, 0], [0.5, 0.5, 0, 0], [0, 1, 0, 0]], np.float32)
    attributes = {
        "POSITION": TRIANGLE,
        "JOINTS_0": np.tile(np.array([0, 1, 0, 0], np.uint8), (3, 1)),
        "WEIGHTS_0": weights,
    }
    bind = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    bind[1, 3, :3] = [0, -5, 0]
    joints = [document.node(translation=[1, 0, 0]), document.node(translation=[0, 5, 0])]
    document.add("skins", joints=joints, inverseBindMatrices=document.accessor(bind))
    # What the node does has no say over a skin.
    document.node(mesh=document.mesh(attributes), skin=0, translation=[100, 0, 0])
    animated(document, "translation", [0, 2], [[0, 5, 0], [0, 5, 6]], node=joints[1])
    world = load(document, tmp_path)
    np.testing.assert_allclose(world.triangles()[0], TRIANGLE + 0.5 * up)
    np.testing.assert_allclose(world.triangles()[1], TRIANGLE + weights[:, :1] * [1, 0, 0], atol=1e-6)
    np.testing.assert_allclose(world.at(0.25, "weights of 0").triangles()[0], TRIANGLE + 0.25 * up)
    moved = TRIANGLE + weights[:, :1] * [1, 0, 0] + weights[:, 1:2] * [0, 0, 3]
    np.testing.assert_allclose(world.at(1, 1).triangles()[1], moved, atol=1e-6)


# What glTF-Validator calls an error ------------------------------------------------------------------------


def _float(d: Document) -> None:
    bad = SQUARE.copy()
    bad[1, 1] = np.nan
    start = d.json["bufferViews"][0]["byteOffset"]
    d.binary[start : start + bad.nbytes] = bad.tobytes()


REFUSED: dict[str, Any] = {
    "ACCESSOR_INVALID_FLOAT": _float,
    "ACCESSOR_TOO_LONG": lambda d: d.json["accessors"][0].update(count=5000),
    "ACCESSOR_INDEX_OOB": lambda d: d.binary.__setitem__(
        slice(d.json["bufferViews"][2]["byteOffset"], None), b"\x09\0" * 6
    ),
    "ACCESSOR_INDEX_PRIMITIVE_RESTART": lambda d: d.binary.__setitem__(
        slice(d.json["bufferViews"][2]["byteOffset"], None), b"\xff\xff" * 6
    ),
    "UNRESOLVED_REFERENCE": lambda d: d.json["meshes"][0]["primitives"][0]["attributes"].update(POSITION=77),
    "BUFFER_VIEW_TOO_LONG": lambda d: d.json["bufferViews"][0].update(byteLength=1 << 20),
    "MESH_PRIMITIVE_UNEQUAL_ACCESSOR_COUNT": lambda d: d.json["accessors"][1].update(count=3),
    "NODE_LOOP": lambda d: d.json["nodes"][0].update(children=[0]),
    "ROTATION_NON_UNIT": lambda d: d.json["nodes"][0].update(rotation=[0, 0, 0, 0]),
    "NODE_MATRIX_NON_TRS": lambda d: d.json["nodes"][0].update(
        matrix=[1.0, 0, 0, 2, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    ),
    "UNKNOWN_ASSET_MAJOR_VERSION": lambda d: d.json["asset"].update(version="1.0"),
    "VALUE_NOT_IN_RANGE": lambda d: d.json["meshes"][0]["primitives"][0].update(mode=9),
    "VALUE_NOT_IN_LIST": lambda d: (
        d.json.setdefault("materials", []).append({"alphaMode": "GLASS"})
        or d.json["meshes"][0]["primitives"][0].update(material=0)
    ),
    "ARRAY_LENGTH_NOT_IN_LIST": lambda d: d.json["nodes"][0].update(scale=[1, 1]),
    "ASSET_MIN_VERSION_GREATER_THAN_VERSION": lambda d: d.json["asset"].update(minVersion="2.1"),
    "ACCESSOR_ANIMATION_INPUT_NON_INCREASING": lambda d: animated(
        d, "translation", [1, 0], [[0, 0, 0], [1, 0, 0]], node=0
    ),
    "ACCESSOR_ANIMATION_INPUT_NEGATIVE": lambda d: animated(
        d, "translation", [-1, 0], [[0, 0, 0], [1, 0, 0]], node=0
    ),
    "ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_COUNT": lambda d: animated(
        d, "translation", [0, 1], [[0, 0, 0]], node=0
    ),
    "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT": lambda d: d.json["accessors"][0].update(type="VEC2"),
    "MESH_PRIMITIVE_INDICES_ACCESSOR_INVALID_FORMAT": lambda d: d.json["accessors"][2].update(
        normalized=True
    ),
    "ANIMATION_SAMPLER_INPUT_ACCESSOR_INVALID_FORMAT": lambda d: animated(
        d, "translation", [[0, 0], [1, 1]], [[0, 0, 0], [1, 0, 0]], node=0
    ),
    "SKIN_IBM_INVALID_FORMAT": lambda d: d.json["nodes"][0].update(
        skin=d.add("skins", joints=[0], inverseBindMatrices=d.accessor(np.zeros((1, 4), np.float32)))
    ),
    "TYPE_MISMATCH": lambda d: d.json["nodes"][0].update(mesh="zero"),
    "EMPTY_ENTITY": lambda d: d.json["meshes"][0].update(primitives=[]),
}


@pytest.mark.parametrize("code", REFUSED)
def test_what_spoils_the_picture_is_refused_by_its_code(tmp_path: Path, code: str) -> None:
    document = Document()
    document.node(mesh=document.square())
    REFUSED[code](document)
    with pytest.raises(raycam.FormatError, match=code):
        load(document, tmp_path)


NOTICED: dict[str, Any] = {
    "MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS": lambda d: d.json["accessors"][0].pop("max"),
    "VALUE_NOT_IN_RANGE": lambda d: d.json["materials"][0].update(emissiveFactor=[2, 0, 0]),
    "SCENE_NON_ROOT_NODE": lambda d: d.json.update(scenes=[{"nodes": [0, d.node(children=[0])]}]),
    "MESH_PRIMITIVE_NO_POSITION": lambda d: d.json["meshes"][0]["primitives"][0]["attributes"].pop(
        "POSITION"
    ),
    "MESH_PRIMITIVE_INCOMPATIBLE_MODE": lambda d: d.json["accessors"][2].update(count=5),
    "UNSUPPORTED_EXTENSION": lambda d: d.use("EXT_of_tomorrow"),
    "MESH_PRIMITIVE_INVALID_ATTRIBUTE": lambda d: d.json["meshes"][0]["primitives"][0]["attributes"].update(
        COLOR=0, _OWN=0
    ),
    "NODE_MATRIX_TRS": lambda d: d.json["nodes"][0].update(
        matrix=np.eye(4).ravel().tolist(), translation=[1, 0, 0]
    ),
    "ROTATION_NON_UNIT": lambda d: d.json["nodes"][0].update(rotation=[0, 0, 0, 2]),
}


@pytest.mark.parametrize("code", NOTICED)
def test_what_is_odd_is_said_by_its_code(tmp_path: Path, code: str) -> None:
    document = Document()
    document.node(mesh=document.square(name="red"))
    NOTICED[code](document)
    world = load(document, tmp_path)
    assert any(f"({code})" in notice for notice in world.notices), world.notices
