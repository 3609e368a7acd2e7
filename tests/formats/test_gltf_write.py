"""Writing of glTF files.

Reading a written file restores the world, or a notice reports the difference.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
import trimesh
from PIL import Image
from support.gltf_document import SQUARE, SQUARE_CORNERS, SQUARE_UVS, TRIANGLE, Document, parse, values
from support.raises import has_notice, notice_codes, raises

TURN = [0.2, -0.4, 0.1, np.sqrt(1 - 0.21)]


def written(world: raycam.World, folder: Path) -> tuple[dict[str, Any], bytes, list[str]]:
    notices = world.to_gltf(folder / "written.glb")
    return *parse((folder / "written.glb").read_bytes()), notices


def assert_same(first: raycam.World, second: raycam.World) -> None:
    np.testing.assert_allclose(second.triangles(), first.triangles(), atol=1e-6)
    np.testing.assert_allclose(second.triangle_colors(), first.triangle_colors(), atol=1e-6)
    assert [thing.name for thing in second.objects] == [thing.name for thing in first.objects]
    for a, b in zip(first.objects, second.objects, strict=True):
        np.testing.assert_allclose(b.matrix, a.matrix, atol=1e-9)
        assert (a.mesh, a.triangles) == (b.mesh, b.triangles)
    assert [light.keys() for light in first.lights] == [light.keys() for light in second.lights]
    for one, other in zip(first.lights, second.lights, strict=True):
        for key, value in one.items():
            if key != "type":
                np.testing.assert_allclose(other[key], value, atol=1e-6)
    assert list(first.cameras) == list(second.cameras)
    for name, camera in first.cameras.items():
        np.testing.assert_allclose(second.cameras[name].P, camera.P, rtol=1e-9, atol=1e-9)
    assert second.variants == first.variants
    assert [a.name for a in second.animations] == [a.name for a in first.animations]


def round_trip(document: Document, folder: Path) -> tuple[raycam.World, raycam.World, list[str]]:
    """Loads, writes and loads a file again; a second writing gives the same bytes."""
    first = raycam.load(document.save(folder / "model.glb"))
    notices = first.to_gltf(folder / "once.glb")
    second = raycam.load(folder / "once.glb")
    second.to_gltf(folder / "twice.glb")
    assert (folder / "once.glb").read_bytes() == (folder / "twice.glb").read_bytes()
    assert_same(first, second)
    return first, second, notices


def picture(color: int = 7) -> bytes:
    pixels = np.random.default_rng(color).integers(0, 256, (4, 4, 4), np.uint8)
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


def full() -> Document:
    """A document with an example of every static feature."""
    document = Document()
    document.use("KHR_lights_punctual", "KHR_materials_variants")
    lights = [
        {"type": "directional", "color": [1, 0.3, 0.1], "intensity": 3.7},
        {"type": "point", "intensity": 20},
        {"type": "spot", "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.6}, "color": [0, 1, 0]},
    ]
    names = [{"name": "one"}, {"name": "other"}]
    document.json["extensions"] = {
        "KHR_lights_punctual": {"lights": lights},
        "KHR_materials_variants": {"variants": names},
    }
    image = document.add("images", bufferView=document.view(picture()), mimeType="image/png", name="noise")
    texture = document.add("textures", source=image, sampler=document.add("samplers", wrapS=33071))
    color = {"baseColorTexture": {"index": texture}, "baseColorFactor": [0.5, 1, 0.25, 1]}
    mesh = document.square(pbrMetallicRoughness=color, name="painted")
    plain = document.add("materials", name="plain", doubleSided=True)
    mappings = {"mappings": [{"material": plain, "variants": [1]}]}
    primitives = document.json["meshes"][mesh]["primitives"]
    primitives[0]["extensions"] = {"KHR_materials_variants": mappings}
    colors = np.array([[0, 0.5, 1, 1], [1, 0.25, 0, 0.5], [0.5, 0.5, 0.5, 1]], np.float32)
    normals = np.array([[0, 0, 1], [0, 0.6, 0.8], [0.6, 0, 0.8]], np.float32)
    attributes = {"POSITION": TRIANGLE, "COLOR_0": colors, "NORMAL": normals}
    given = {name: document.accessor(value) for name, value in attributes.items()}
    primitives.append({"attributes": given, "material": plain})
    lens = {"yfov": 0.7, "aspectRatio": 1.5, "znear": 0.1}
    document.add("cameras", type="perspective", perspective=lens, name="eye")
    document.node(mesh=mesh, name="a", translation=[1, 2, 3], rotation=TURN, scale=[2, 3, -4])
    document.node(mesh=mesh, name="b", translation=[-4, 0, 0])
    document.node(camera=0, name="on a pole", translation=[1, 2, 9], rotation=TURN)
    plan = {"xmag": 4.0, "ymag": 3.0, "znear": 0.0, "zfar": 1e6}
    document.add("cameras", type="orthographic", orthographic=plan, name="plan")
    document.node(camera=1, name="above", translation=[0, 9, 0], rotation=TURN)
    for i in range(3):
        document.node(extensions={"KHR_lights_punctual": {"light": i}}, rotation=TURN, translation=[0, i, 0])
    return document


def test_written_glb_shows_the_same_image(tmp_path: Path) -> None:
    first, second, notices = round_trip(full(), tmp_path)
    assert not notices
    for name in first.variants:
        one, other = first.with_variant(name), second.with_variant(name)
        np.testing.assert_allclose(other.triangle_colors(), one.triangle_colors(), atol=1e-6)
    camera = raycam.Camera.look_at([0, 1, 12], [0, 1, 0], [0, 1, 0], size=(48, 32), fov=40)
    pictures = [raycam.render(world, camera, samples=4)["color"] for world in (first, second)]
    np.testing.assert_allclose(pictures[1], pictures[0], atol=1e-5)


def test_written_glb_is_read_by_trimesh(tmp_path: Path) -> None:
    world = raycam.load(full().save(tmp_path / "model.glb"))
    world.to_gltf(tmp_path / "written.glb")
    scene = trimesh.load(tmp_path / "written.glb")
    theirs = np.concatenate([part.triangles for part in scene.dump()])
    assert len(theirs) == world.counts["triangles"]
    for mine in world.triangles():
        # trimesh may choose the first vertex of a triangle and the winding of mirrored triangles.
        near = np.abs(np.sort(theirs, axis=1) - np.sort(mine, axis=0)).max(axis=(1, 2))
        assert near.min() < 1e-5


TEXTURE = {"index": 0}
MOVED = {
    "index": 0,
    "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 0.5, "scale": [2, 3]}},
}
MATERIALS: dict[str, dict[str, Any]] = {
    "metallic roughness": {
        "name": "m",
        "doubleSided": True,
        "alphaMode": "MASK",
        "alphaCutoff": 0.25,
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 0.3, 0.4],
            "baseColorTexture": MOVED,
            "metallicFactor": 0.7,
            "roughnessFactor": 0.3,
            "metallicRoughnessTexture": TEXTURE,
        },
        "normalTexture": {"index": 0, "scale": 0.5},
        "occlusionTexture": {"index": 0, "strength": 0.75},
        "emissiveTexture": {"index": 0, "texCoord": 1},
        "emissiveFactor": [1, 0.5, 0.25],
    },
    "blend": {"alphaMode": "BLEND", "emissiveFactor": [0.1, 0, 0]},
    "KHR_materials_emissive_strength": {"emissiveStrength": 8},
    "KHR_materials_ior": {"ior": 1.33},
    "KHR_materials_specular": {
        "specularFactor": 0.5,
        "specularTexture": TEXTURE,
        "specularColorFactor": [2, 0.5, 1],
        "specularColorTexture": TEXTURE,
    },
    "KHR_materials_transmission": {"transmissionFactor": 0.9, "transmissionTexture": TEXTURE},
    "KHR_materials_volume": {
        "thicknessFactor": 0.1,
        "thicknessTexture": TEXTURE,
        "attenuationDistance": 2.5,
        "attenuationColor": [0.5, 0.25, 0.125],
    },
    "KHR_materials_clearcoat": {
        "clearcoatFactor": 0.5,
        "clearcoatTexture": TEXTURE,
        "clearcoatRoughnessFactor": 0.25,
        "clearcoatRoughnessTexture": MOVED,
        "clearcoatNormalTexture": {"index": 0, "scale": 2},
    },
    "KHR_materials_sheen": {
        "sheenColorFactor": [0.1, 0.2, 0.3],
        "sheenColorTexture": TEXTURE,
        "sheenRoughnessFactor": 0.5,
        "sheenRoughnessTexture": TEXTURE,
    },
    "KHR_materials_iridescence": {
        "iridescenceFactor": 0.5,
        "iridescenceTexture": TEXTURE,
        "iridescenceIor": 1.75,
        "iridescenceThicknessMinimum": 200,
        "iridescenceThicknessMaximum": 300,
        "iridescenceThicknessTexture": TEXTURE,
    },
    "KHR_materials_anisotropy": {
        "anisotropyStrength": 0.5,
        "anisotropyRotation": 0.25,
        "anisotropyTexture": TEXTURE,
    },
    "KHR_materials_diffuse_transmission": {
        "diffuseTransmissionFactor": 0.5,
        "diffuseTransmissionTexture": TEXTURE,
        "diffuseTransmissionColorFactor": [0.5, 0.25, 0.75],
        "diffuseTransmissionColorTexture": TEXTURE,
    },
    "KHR_materials_unlit": {},
}


def plainly(value: Any) -> Any:
    """The material with rounded numbers and without texture indices.

    Indices may differ, because one image may be used both as colour and as data.
    """
    if isinstance(value, dict):
        return {key: plainly(item) for key, item in value.items() if key != "index"}
    if isinstance(value, list):
        return [plainly(item) for item in value]
    return round(value, 5) if isinstance(value, float) else value


@pytest.mark.parametrize("name", MATERIALS)
def test_all_material_keys_are_restored(tmp_path: Path, name: str) -> None:
    """The material contains every supported key of every extension."""
    given = MATERIALS[name]
    if name.startswith("KHR"):
        given = {"extensions": {name: given}}
        if name == "KHR_materials_emissive_strength":
            given["emissiveFactor"] = [1.0, 0.5, 0.25]
        if name == "KHR_materials_unlit":
            given["pbrMetallicRoughness"] = {"metallicFactor": 0, "roughnessFactor": 0.9}
    document = Document()
    document.use("KHR_texture_transform", *given.get("extensions", {}))
    image = document.add("images", bufferView=document.view(picture()), mimeType="image/png")
    document.add("textures", source=image)
    mesh = document.mesh(
        {"POSITION": SQUARE, "TEXCOORD_0": SQUARE_UVS, "TEXCOORD_1": SQUARE_UVS},
        SQUARE_CORNERS,
        material=document.add("materials", **given),
    )
    document.node(mesh=mesh, name="square")
    world, _, notices = round_trip(document, tmp_path)
    json, _ = parse((tmp_path / "once.glb").read_bytes())
    assert plainly(json["materials"][0]) == plainly(given)
    assert not notices
    assert set(notice_codes(world.notices)) <= {"ignored_element"}, world.notices
    if name.startswith("KHR"):
        assert name in json["extensionsUsed"]


def test_images_are_restored(tmp_path: Path) -> None:
    for bits, kind in ((8, np.uint8), (16, np.uint16)):
        pixels = np.random.default_rng(3).integers(0, 1 << bits, (4, 4), kind)
        file = io.BytesIO()
        Image.fromarray(pixels).save(file, "PNG")
        document = Document()
        image = document.add("images", bufferView=document.view(file.getvalue()), mimeType="image/png")
        texture = document.add("textures", source=image)
        document.node(mesh=document.square(occlusionTexture={"index": texture}), name="square")
        round_trip(document, tmp_path)
        json, binary = parse((tmp_path / "once.glb").read_bytes())
        view = json["bufferViews"][json["images"][0]["bufferView"]]
        found = Image.open(io.BytesIO(binary[view["byteOffset"] :][: view["byteLength"]]))
        if bits == 8:
            np.testing.assert_array_equal(np.asarray(found)[..., 0], pixels)
        else:  # Pillow reads only the upper 8 of 16 bits of colour images
            np.testing.assert_allclose(np.asarray(found)[..., 0], pixels >> 8, atol=1)


def test_world_built_in_python_is_written_with_notices(tmp_path: Path) -> None:
    """The world has many properties that glTF does not support.

    These are the z axis up, face colours, Phong materials, shear, and some lights and cameras.
    """
    world = raycam.World()
    box = trimesh.creation.box()
    colors = np.linspace(0, 1, 36).reshape(12, 3)
    shear = np.array([[1.0, 0.7, 0, 4], [0, 2, 0.3, 5], [0.1, 0, -1, 6]])
    world.add_mesh(box.vertices, box.faces, name="plain")
    world.add_mesh(
        box.vertices, box.faces, name="colored", face_colors=colors, matrix=shear, category="thing"
    )
    world.add_mesh(box.vertices / 3, box.faces, name="shiny", material={"diffuse": 0.5, "specular": 0.2})
    world.add_light(type="area", position=[0, 0, 3], u=[1, 0, 0], v=[0, 1, 0], radiance=[1, 1, 1])
    world.add_light(type="bulb", position=[1, 2, 3], power=[4 * np.pi] * 3, radius=0.1)
    k = [[500, 0, 300], [0, 500, 240], [0, 0, 1]]
    world.add_camera(raycam.Camera(k, np.eye(3), [1, 2, 3], size=(640, 480)), "off the middle")
    _, _, notices = written(world, tmp_path)
    for code, fact in (
        ("converted_up_axis", "z"),
        ("approximated_value", "float32"),
        ("not_written", "light 0"),
        ("not_written", "light 1"),
        ("not_written", "off the middle"),
        ("approximated_value", "shiny"),
        ("not_written", "categories"),
    ):
        assert has_notice(notices, code, fact), fact
    again = raycam.load(tmp_path / "written.glb")
    assert again.up == "y"
    turned = world.triangles() @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]).T
    np.testing.assert_allclose(again.triangles(), turned, atol=1e-6)
    np.testing.assert_allclose(again.triangle_colors()[:24], world.triangle_colors()[:24], atol=1e-6)
    np.testing.assert_allclose(again.lights[0]["position"], [1, 3, -2], atol=1e-12)
    np.testing.assert_allclose(again.lights[0]["intensity"], [1, 1, 1], rtol=1e-6)
    np.testing.assert_allclose(again.cameras["off the middle"].C, [1, 3, -2], atol=1e-12)


def animated() -> Document:
    """A document whose nodes, weights, skin, light, camera and material are animated."""
    document = Document()
    used = ["KHR_animation_pointer", "KHR_lights_punctual", "KHR_texture_transform", "KHR_node_visibility"]
    document.use(*used, "KHR_materials_emissive_strength")
    up = np.array([[0, 0, 0], [0, 0, 1], [0, 2, 0]], np.float32)
    morphing = document.mesh({"POSITION": TRIANGLE}, targets=[{"POSITION": document.accessor(up)}])
    document.node(mesh=morphing, name="morphing")
    weights = np.array([[1, 0, 0, 0], [0.5, 0.5, 0, 0], [0, 1, 0, 0]], np.float32)
    joints = np.tile(np.array([0, 1, 0, 0], np.uint8), (3, 1))
    skinned = document.mesh({"POSITION": TRIANGLE, "JOINTS_0": joints, "WEIGHTS_0": weights})
    root = document.node(name="root", children=[2])
    assert root == 1
    document.node(translation=[0, 1, 0])
    bind = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    document.add("skins", joints=[1, 2], inverseBindMatrices=document.accessor(bind))
    document.node(mesh=skinned, skin=0, name="skinned")
    lens = {"yfov": 0.5, "aspectRatio": 1.5, "znear": 0.1}
    document.node(camera=document.add("cameras", type="perspective", perspective=lens), name="eye")
    lights = {"lights": [{"type": "spot", "color": [1, 0.5, 0], "intensity": 2}]}
    document.json["extensions"] = {"KHR_lights_punctual": lights}
    document.node(extensions={"KHR_lights_punctual": {"light": 0}}, translation=[0, 5, 0])
    image = document.add("images", bufferView=document.view(picture()), mimeType="image/png")
    texture = document.add("textures", source=image, sampler=document.add("samplers", magFilter=9728))
    moved = {"index": texture, "extensions": {"KHR_texture_transform": {"offset": [0, 0]}}}
    square = document.square(pbrMetallicRoughness={"baseColorTexture": moved}, emissiveFactor=[0.5, 0, 0])
    document.node(mesh=square, name="square")
    plan = {"xmag": 2, "ymag": 1, "znear": 0, "zfar": 2e6}
    document.node(camera=document.add("cameras", type="orthographic", orthographic=plan), name="plan")

    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []
    times = document.accessor(np.array([0, 1, 2], np.float32))

    def move(target: dict[str, Any] | str, output: Any, interpolation: str = "LINEAR") -> None:
        data = document.accessor(np.asarray(output, np.float32))
        samplers.append({"input": times, "output": data, "interpolation": interpolation})
        if isinstance(target, str):
            target = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": target}}}
        channels.append({"sampler": len(samplers) - 1, "target": target})

    move({"node": 0, "path": "weights"}, [0, 1, 0.5])
    move({"node": 2, "path": "translation"}, [[0, 1, 0], [0, 3, 0], [2, 1, 0]])
    move("/cameras/0/perspective/yfov", [0.5, 1, 0.5])
    move("/cameras/1/orthographic/ymag", [1, 3, 1])
    move("/extensions/KHR_lights_punctual/lights/0/color", [[1, 0.5, 0], [0, 1, 0], [1, 1, 1]])
    move("/extensions/KHR_lights_punctual/lights/0/intensity", [2, 6, 2])
    move("/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle", [0.7, 0.2, 0.7])
    move("/materials/0/pbrMetallicRoughness/baseColorFactor", [[1, 1, 1, 1], [0.5, 0, 0, 1], [0, 0, 1, 1]])
    offset = "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/offset"
    move(offset, [[0, 0], [0.5, 0], [0, 0.25]], "STEP")
    move("/nodes/6/extensions/KHR_node_visibility/visible", [1, 1, 0], "STEP")
    document.add("animations", name="all", samplers=samplers, channels=channels)
    return document


def test_animation_pointers_move_cameras_lights_and_materials(tmp_path: Path) -> None:
    world = raycam.load(animated().save(tmp_path / "model.glb"))
    assert not world.notices
    half, whole = world.at(0.5), world.at(1)
    height = world.cameras["eye"].size[1]
    for moment, fov in ((world, 0.5), (half, 0.75), (whole, 1)):
        focal = moment.cameras["eye"].K[1, 1]
        assert 2 * np.arctan(height / 2 / focal) == pytest.approx(fov, rel=1e-6)
    for moment, high in ((world, 1), (half, 2), (whole, 3)):
        pixels, _ = moment.cameras["plan"].project([[-2, high, -1], [2, -high, -1]])
        np.testing.assert_allclose(pixels + 0.5, [[0, 0], world.cameras["plan"].size], atol=1e-6)
    np.testing.assert_allclose(half.lights[0]["intensity"], np.array([0.5, 0.75, 0]) * 4, rtol=1e-6)
    np.testing.assert_allclose(half.lights[0]["outer"], np.degrees(0.45), rtol=1e-6)
    np.testing.assert_allclose(whole.lights[0]["intensity"], [0, 6, 0], rtol=1e-6)
    np.testing.assert_allclose(
        half.triangle_colors()[-2:] / world.triangle_colors()[-2:], [[0.75, 0.5, 0.5]] * 2, rtol=1e-5
    )
    # An offset of half the width shows other texels of the 4 x 4 texture.
    camera = raycam.Camera.look_at(
        [0, 0, 9], [0, 0, 0], [0, 1, 0], size=(40, 40), fov=2 * np.degrees(np.arctan(1 / 9))
    )
    before = raycam.render(world.at(0.999), camera, integrator="flat", samples=1)["color"]
    after = raycam.render(whole, camera, integrator="flat", samples=1)["color"]
    shown = raycam.render(world, camera, channels="instance", samples=1)["instance"] == 2
    assert np.abs(before - after)[shown].max() > 0.05
    assert world.at(2).objects[2].triangles == 1, "hidden: nothing to see"
    # Calls with decreasing times give the same world, because no state of an earlier call remains.
    assert whole.at(0).to_bytes() == world.at(0).to_bytes()


def test_animations_are_written(tmp_path: Path) -> None:
    first, second, notices = round_trip(animated(), tmp_path)
    assert not notices
    for time in (0.0, 0.3, 1.0, 1.7, 2.0):
        assert_same(first.at(time), second.at(time))
    json, binary = parse((tmp_path / "once.glb").read_bytes())
    skin = json["skins"][0]
    assert values(json, binary, skin["inverseBindMatrices"]).shape == (2, 4, 4)
    # A world at a time is written as a static world.
    notices = first.at(1.0).to_gltf(tmp_path / "moment.glb")
    assert has_notice(notices, "not_written", "animation")
    moment = raycam.load(tmp_path / "moment.glb")
    assert not moment.animations
    np.testing.assert_allclose(moment.triangles(), first.at(1.0).triangles(), atol=1e-6)


def test_repeated_joints_of_a_vertex_are_merged(tmp_path: Path) -> None:
    """Some programs list a joint twice for a vertex, which glTF forbids (3.7.3.3)."""
    document = Document()
    joints = np.array([[1, 0, 1, 0], [0, 0, 0, 0], [1, 1, 1, 1]], np.uint8)
    weights = np.array([[0.5, 0.25, 0.25, 0], [0.5, 0.5, 0, 0], [1, 1, 1, 1]], np.float32)
    mesh = document.mesh({"POSITION": TRIANGLE, "JOINTS_0": joints, "WEIGHTS_0": weights})
    nodes = [document.node(), document.node(translation=[0, 4, 0])]
    document.add("skins", joints=nodes)
    document.node(mesh=mesh, skin=0)
    still = document.accessor(np.array([[0, 4, 0], [0, 4, 0]], np.float32))
    sampler = {"input": document.accessor(np.array([0, 1], np.float32)), "output": still}
    target = {"node": nodes[1], "path": "translation"}
    document.add("animations", samplers=[sampler], channels=[{"sampler": 0, "target": target}])
    world = raycam.load(document.save(tmp_path / "model.glb"))
    moved = TRIANGLE + np.array([[0, 3, 0], [0, 0, 0], [0, 4, 0]])
    np.testing.assert_allclose(world.triangles()[0], moved, atol=1e-6)
    json, binary, _ = written(world, tmp_path)
    attributes = json["meshes"][0]["primitives"][0]["attributes"]
    assert values(json, binary, attributes["JOINTS_0"]).tolist() == [[1, 0, 0, 0], [0] * 4, [1, 0, 0, 0]]
    assert values(json, binary, attributes["WEIGHTS_0"]).tolist() == [
        [0.75, 0.25, 0, 0],
        [1, 0, 0, 0],
        [1, 0, 0, 0],
    ]


def test_video_plan_renders_an_animation(tmp_path: Path) -> None:
    from raycam.video import VideoPlan

    world = raycam.load(animated().save(tmp_path / "model.glb"))
    film = VideoPlan(world, world.camera("eye").resized((36, 24)), fps=2, samples=1, integrator="flat")
    assert (len(film), film.seconds, film.notices) == (4, 2, [])
    for number in (0, 2):
        moment = world.at(number / 2)
        expected = raycam.render(
            moment, moment.camera("eye").resized((36, 24)), integrator="flat", samples=1, frame=number
        )
        np.testing.assert_array_equal(film.frame(number)["color"], expected["color"])
    assert len(VideoPlan(world, fps=2, seconds=5, animation="all")) == 10
    with raises(raycam.SettingsError, code="unknown_name", mentions=["'none'", "'all'"]):
        VideoPlan(world, animation="none")


CAMERA = raycam.Camera.look_at([0, -5, 1], [0, 0, 0], size=(640, 480), fov=40)
BALL = {"sphere": {"radius": 1}, "name": "ball"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda world: world.add_object(box={}, category="crate"), "categories of objects are omitted"),
        (lambda world: world.add_object(plane={}, shadow_catcher=True), "1 shadow catcher written"),
        (lambda world: world.add_object(box={}, visible=False), "1 invisible object omitted"),
        (lambda world: world.add_object(box={}, type="metal", metal="gold"), "its index of refraction is converted"),
        (lambda world: world.add_light("sky", radiance=1), "light 0: omitted.* sky"),
        (
            lambda world: world.add_light("disk", position=[2, 0, 2], direction=[0, 0, -1], radius=1, radiance=1),
            "light 0: omitted.* disk",
        ),
        (
            lambda world: world.add_light("sun", direction=[0, 0, -1], irradiance=3, angular_diameter=0.53),
            "light 0: its angular diameter is omitted",
        ),
        (lambda world: world.set_video(fps=10, seconds=1, orbit={"target": [0, 0, 0]}), r"\[video\] is omitted"),
        (
            lambda world: world.add_camera(CAMERA.replace(distortion=[-0.2, 0.05, 0, 0], model="opencv"), "a"),
            'camera "a": its distortion cannot be represented',
        ),
        (lambda world: world.add_camera(CAMERA.with_aperture(0.1, focus=4), "a"), 'camera "a": its aperture cannot'),
        (
            lambda world: world.add_camera(CAMERA.cropped(3, 2, 620, 465), "a"),
            'camera "a": .*a principal point off the centre, or skew cannot be represented',
        ),
        (
            lambda world: world.add_camera(
                raycam.Camera.from_matrix([[9, 0, 0, 16], [0, 0, -9, 12], [0, 0, 0, 1]], size=(32, 24)), "a"
            ),
            'camera "a" omitted: its centre is at infinity',
        ),
    ],
    ids=range(12),
)  # fmt: skip
def test_unsupported_content_gives_a_notice_on_writing(
    tmp_path: Path, change: Callable[[raycam.World], object], words: str
) -> None:
    plain, other = raycam.World(), raycam.World()
    for world in (plain, other):
        world.add_object(**BALL)
    change(other)
    told, before = other.to_gltf(tmp_path / "a.glb"), plain.to_gltf(tmp_path / "b.glb")
    added = [notice for notice in told if notice not in before]
    assert len(added) == 1, told
    assert re.search(words, str(added[0])), added
