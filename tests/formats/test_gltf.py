"""Reading of glTF files: each test builds a small document with a known result."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
import trimesh
from scipy.spatial.transform import Rotation
from support.gltf_document import (
    ARROWS,
    SQUARE,
    SQUARE_CORNERS,
    SQUARE_UVS,
    TRIANGLE,
    Document,
    animated,
    load,
    png,
    seen,
)
from support.raises import has_notice, raises

DATA = Path(__file__).parent / "data" / "gltf"


# Accessors ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("normalized", [False, True])
@pytest.mark.parametrize("kind", ["int8", "uint8", "int16", "uint16", "float32"])
def test_every_component_type_is_read(tmp_path: Path, kind: str, normalized: bool) -> None:
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
def test_every_index_type_is_read(tmp_path: Path, kind: str | None) -> None:
    document = Document()
    order = [2, 0, 3, 1, 3, 0]
    points = SQUARE if kind else SQUARE[order]
    document.node(mesh=document.mesh({"POSITION": points}, np.array(order, kind) if kind else None))
    np.testing.assert_array_equal(load(document, tmp_path).triangles().reshape(-1, 3), SQUARE[order])


def test_strided_and_interleaved_accessors_are_read(tmp_path: Path) -> None:
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


@pytest.mark.parametrize("based", [True, False])
def test_sparse_accessors_are_read(tmp_path: Path, based: bool) -> None:
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
def test_points_and_lines_are_omitted_with_a_notice(tmp_path: Path, mode: int, word: str) -> None:
    document = Document()
    document.node(mesh=document.mesh({"POSITION": SQUARE}, mode=mode))
    document.node(mesh=document.square())
    world = load(document, tmp_path)
    assert world.counts["triangles"] == 2
    assert has_notice(world.notices, "ignored_element", "meshes[0].primitives[0]", word)


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
        # All triangles have the same winding and cover the area once.
        sign = 1 if mode == 6 else -1
        assert (sign * normals[:, 2] > 0).all()
        np.testing.assert_allclose(sign * normals[:, 2].sum() / 2, area, rtol=1e-6)


@pytest.mark.parametrize("scale", [[1, 1, 1], [-1, 1, 1], [-1, -1, -1], [2, 1, -3]])
def test_negative_scale_keeps_faces_turned_outwards(tmp_path: Path, scale: list[float]) -> None:
    box = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    document = Document()
    points = np.asarray(box.vertices, np.float32)
    mesh = document.mesh(
        {"POSITION": points, "NORMAL": points / np.linalg.norm(points, axis=1, keepdims=True)},
        np.asarray(box.faces, np.uint16).ravel(),
        # The material is single-sided: an inside-out mesh would be invisible.
        material=document.add("materials", pbrMetallicRoughness={"baseColorFactor": [1, 0, 0, 1]}),
    )
    document.node(mesh=mesh, scale=scale)
    world = load(document, tmp_path)
    camera = raycam.Camera.look_at([0, 0, 6], [0, 0, 0], [0, 1, 0], size=(32, 32), fov=20)
    frame = raycam.render(world, camera, channels=["color", "instance", "shading_normal"], samples=4)
    hit = frame["instance"] >= 0
    assert hit.sum() > 50
    assert (frame["color"][hit][:, 0] > 0.02).all(), "seen, and lit from outside"
    # The scale turns the sphere into an ellipsoid, and the normals are those of the ellipsoid.
    pixels = np.argwhere(hit)[:, ::-1].astype(float)
    origins, ways = camera.rays(pixels)
    found = world.cast_rays(origins, ways)
    truth = found["position"] / np.square(scale)
    truth /= np.linalg.norm(truth, axis=1, keepdims=True)
    shown = frame["shading_normal"][hit]
    assert np.median((truth * shown).sum(1)) > 0.995


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_zero_scale_along_one_axis_gives_a_flat_mesh(tmp_path: Path, axis: int, moving: bool) -> None:
    """A mesh may be omitted only if all three scales are zero (glTF 2.0, 3.5.3)."""
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
    document.node(mesh=mesh, scale=[0, 0, 2])  # this object is a line, which is invisible
    if moving:
        animated(document, "scale", [0, 1], [[1, 1, 1], scale], node=node)
    world = load(document, tmp_path)
    assert len(world.objects) == (2 if moving else 1)
    assert has_notice(world.notices, "dropped_geometry", "nodes[") != moving
    if moving:
        world = world.at(1)
    normal = turn.as_matrix()[:, axis]
    camera = raycam.Camera.look_at(3 * normal, [0, 0, 0], np.roll(normal, 1), size=(64, 64), fov=90)
    frame = raycam.render(world, camera, channels=["color", "depth", "normal", "shading_normal"], samples=1)
    hit = np.isfinite(frame["depth"])
    # A disc of radius 2, seen from 3 above: a pixel is 6 / 64 wide.
    assert abs(hit.sum() * (6 / 64) ** 2 / (4 * np.pi) - 1) < 0.01
    np.testing.assert_allclose(frame["depth"][hit], 3, rtol=1e-6)
    for channel in ("normal", "shading_normal"):
        np.testing.assert_allclose(frame[channel][hit] @ normal, 1, rtol=1e-5)
    assert (frame["color"][hit] > 0.05).all()


def test_node_transforms_are_multiplied_down_the_tree(tmp_path: Path) -> None:
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
    # trimesh reverses the vertex order of mirrored triangles.
    np.testing.assert_allclose(world.triangles()[0, ::-1], theirs.vertices[theirs.faces][0], atol=1e-6)


def test_gpu_instances_become_objects(tmp_path: Path) -> None:
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
    assert has_notice(world.notices, "ignored_key", "EXT_mesh_gpu_instancing", "_ID")


def test_hidden_nodes_are_omitted_with_a_notice(tmp_path: Path) -> None:
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
    assert has_notice(world.notices, "hidden_part", "nodes[0]")


def test_default_scene_is_shown_with_a_notice(tmp_path: Path) -> None:
    document = Document()
    mesh = document.square()
    first, second = document.node(mesh=mesh, name="first"), document.node(mesh=mesh, name="second")
    document.json |= {"scenes": [{"nodes": [first]}, {"nodes": [second]}], "scene": 1}
    world = load(document, tmp_path)
    assert [thing.name for thing in world.objects] == ["second"]
    assert has_notice(world.notices, "first_only", "scene 1")


def test_compressed_geometry_is_read() -> None:
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
def test_perspective_camera_has_the_projection_of_the_specification(
    tmp_path: Path, far: dict[str, float]
) -> None:
    fov, aspect = 0.7, 1.5
    lens = {"yfov": fov, "aspectRatio": aspect, "znear": 0.1, **far}
    document = Document()
    document.add("cameras", type="perspective", perspective=lens, name="eye")
    turn = Rotation.from_euler("yx", [40, -20], degrees=True)
    # Scale has no effect on cameras.
    document.node(camera=0, translation=[1, 2, 3], rotation=turn.as_quat().tolist(), scale=[2, 2, 2])
    world = load(document, tmp_path)
    camera = world.cameras["eye"]
    width, height = camera.size
    assert width / height == pytest.approx(aspect, rel=2e-3)
    np.testing.assert_allclose(camera.C, [1, 2, 3])
    # The corners of the image plane, computed with the specification's projection matrix.
    y = np.tan(fov / 2)
    x = y * width / height
    points = np.array([1, 2, 3]) + turn.apply([[-x, y, -1], [x, y, -1], [x, -y, -1], [0, 0, -5], [0, 0, 1]])
    pixels, in_front = camera.project(points)
    corners = [[0, 0], [width, 0], [width, height], [width / 2, height / 2]]
    np.testing.assert_allclose(pixels[:4] + 0.5, corners, atol=1e-6)
    assert in_front.tolist() == [True] * 4 + [False]


def test_orthographic_camera_shows_the_box_of_its_magnifications(tmp_path: Path) -> None:
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
    # The near and far corners of the visible box (glTF 2.0, 3.10.3), and a point behind the camera.
    box = np.array([[-3, 1.5, -1], [3, 1.5, -7], [3, -1.5, -50], [-3, -1.5, -1], [0, 0, 1]])
    pixels, seen = camera.project(turn.apply(box) + np.array([1, 2, 3]))
    corners = [[0, 0], [width, 0], [width, height], [0, height]]
    np.testing.assert_allclose(pixels[:4] + 0.5, corners, atol=1e-6)
    assert seen.tolist() == [True] * 4 + [False]


def test_orthographic_camera_with_negative_magnification_gives_a_notice(tmp_path: Path) -> None:
    document = Document()
    lens = {"xmag": -1.0, "ymag": 1.0, "znear": 0.1, "zfar": 10.0}
    document.node(camera=document.add("cameras", type="orthographic", orthographic=lens))
    document.node(mesh=document.square())
    world = load(document, tmp_path)
    assert len(world.cameras) == 1
    assert has_notice(world.notices, "replaced_value", "CAMERA_XMAG_YMAG_NEGATIVE")


def test_punctual_lights_are_read(tmp_path: Path) -> None:
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
    assert (sun["type"], bulb["type"], spot["type"]) == ("sun", "point", "spot")
    np.testing.assert_allclose(sun["direction"], [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(sun["irradiance"], [3, 1.5, 0])
    np.testing.assert_allclose((bulb["position"], bulb["intensity"]), ([0, 1, 0], [20] * 3))
    np.testing.assert_allclose([spot["inner"], spot["outer"]], np.degrees([0.2, 0.6]))
    np.testing.assert_allclose((spot["position"], spot["direction"]), ([0, 2, 0], [0, -1, 0]), atol=1e-12)
    world = load(document, tmp_path)
    assert has_notice(world.notices, "ignored_feature", "range")


def omitted(world: raycam.World) -> list[str]:
    """The paths of the elements that notices report as omitted, without the file name."""
    notices = [notice for notice in world.notices if notice.code == "ignored_element"]
    return [subject.split(": ")[-1] for notice in notices for subject in notice.subjects]


def lamps(lights: object) -> Document:
    """A square and one node per light; the lights are not validated."""
    document = Document()
    document.use("KHR_lights_punctual")
    document.json["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    for i in range(len(lights) if isinstance(lights, list) else 1):
        document.node(extensions={"KHR_lights_punctual": {"light": i}}, translation=[0, 0, 3])
    document.node(mesh=document.square())
    return document


@pytest.mark.parametrize(
    ("inner", "outer", "expected", "noticed"),
    [
        (float(np.float32(np.pi / 2)), float(np.float32(np.pi / 2)), (90, 90), False),
        (0.3, 0.3, (0.3, 0.3), False),
        (0.0, float(np.float32(np.pi / 2)), (0, 90), False),
        (0.4, 0.3, (0.3, 0.3), True),
        (-0.1, 0.3, (0, 0.3), True),
        (0.2, 3.0, (0.2, 90), True),
    ],
)
def test_spot_angles_out_of_range_are_clamped(
    tmp_path: Path, inner: float, outer: float, expected: tuple[float, float], noticed: bool
) -> None:
    document = lamps([{"type": "spot", "spot": {"innerConeAngle": inner, "outerConeAngle": outer}}])
    world = load(document, tmp_path)
    degrees = [value if value == 90 else np.degrees(value) for value in expected]
    np.testing.assert_allclose([world.lights[0]["inner"], world.lights[0]["outer"]], degrees)
    clamped = [notice for notice in world.notices if notice.code == "clamped_value"]
    assert len(clamped) == noticed
    assert all("lights[0].spot" in notice.subjects[0] for notice in clamped)
    frame = raycam.render(world, world.default_camera((8, 8)), samples=1)
    assert np.isfinite(frame["color"]).all()


@pytest.mark.parametrize(
    "faulty",
    [
        {"type": "area"},
        {"type": 3},
        {"intensity": 1},
        {"type": "point", "color": [1, 1]},
        {"type": "point", "intensity": "bright"},
        {"type": "spot", "spot": {"outerConeAngle": 0}},
        {"type": "spot", "spot": "wide"},
        None,
        "sun",
    ],
)
def test_faulty_light_is_omitted_with_a_notice(tmp_path: Path, faulty: object) -> None:
    world = load(lamps([{"type": "directional", "intensity": 3}, faulty, {"type": "point"}]), tmp_path)
    assert [light["type"] for light in world.lights] == ["sun", "point"]
    assert len(world.objects) == 1
    assert omitted(world) == ["nodes[1].extensions.KHR_lights_punctual.light"]


@pytest.mark.parametrize("lights", [3, {"0": {}}, [5]])
def test_faulty_list_of_lights_is_omitted_with_a_notice(tmp_path: Path, lights: object) -> None:
    world = load(lamps(lights), tmp_path)
    assert (len(world.objects), len(world.lights)) == (1, 0)
    assert omitted(world) == ["nodes[0].extensions.KHR_lights_punctual.light"]


def test_missing_light_is_omitted_with_a_notice(tmp_path: Path) -> None:
    document = lamps([{"type": "point"}])
    document.json["nodes"][0]["extensions"]["KHR_lights_punctual"] = {"light": 7}
    assert omitted(load(document, tmp_path)) == ["nodes[0].extensions.KHR_lights_punctual.light"]


@pytest.mark.parametrize(
    "camera",
    [
        {"type": "fisheye"},
        {"type": "perspective", "perspective": {"yfov": 0, "znear": 1}},
        {"type": "perspective", "perspective": {"yfov": "wide", "znear": 1}},
        {"type": "orthographic"},
        {},
    ],
)
def test_faulty_camera_is_omitted_with_a_notice(tmp_path: Path, camera: dict[str, object]) -> None:
    document = Document()
    document.node(camera=document.add("cameras", **camera))
    document.node(mesh=document.square())
    world = load(document, tmp_path)
    assert (len(world.objects), len(world.cameras)) == (1, 0)
    assert omitted(world) == ["nodes[0].camera"]


def test_non_integer_camera_index_is_omitted_with_a_notice(tmp_path: Path) -> None:
    document = Document()
    document.node(mesh=document.square(), camera="zero")
    world = load(document, tmp_path)
    assert (len(world.objects), len(world.cameras)) == (1, 0)
    assert omitted(world) == ["nodes[0].camera"]


# Missing files and parts -------------------------------------------------------------------------------------------


def test_unknown_extensions_give_a_notice_or_are_refused_if_required(tmp_path: Path) -> None:
    document = Document()
    document.use("EXT_of_tomorrow")
    document.node(mesh=document.square())
    world = load(document, tmp_path)
    assert world.counts["triangles"] == 2
    assert has_notice(world.notices, "ignored_feature", "EXT_of_tomorrow")
    document.use("EXT_of_tomorrow", required=True)
    with raises(
        raycam.FormatError,
        code="unsupported_feature",
        mentions=["extensionsRequired", "EXT_of_tomorrow", "UNSUPPORTED_EXTENSION"],
    ):
        load(document, tmp_path)
