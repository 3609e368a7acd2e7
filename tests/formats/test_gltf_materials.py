"""Materials and textures of glTF files in rendered images."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from support.gltf_document import (
    ARROWS,
    SQUARE,
    SQUARE_CORNERS,
    SQUARE_UVS,
    TRIANGLE,
    Document,
    load,
    png,
    seen,
)
from support.raises import has_notice, raises


def textured(document: Document, pixels: Any, info: dict[str, Any] | None = None, **keys: Any) -> None:
    """A square with this image as its texture, without interpolation."""
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
def test_texture_transforms_are_applied(
    tmp_path: Path, info: dict[str, Any], matrix: list[list[float]]
) -> None:
    """(u, v) is transformed by translation * rotation * scale, as in the extension.

    The transformed texture is repeated.
    """
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
def test_wrap_modes_are_applied(tmp_path: Path, code: int, columns: list[int]) -> None:
    pixels = np.array([[[255, 0, 0], [0, 0, 255]]], np.uint8)
    document = Document()
    document.use("KHR_texture_transform")
    info = {"extensions": {"KHR_texture_transform": {"scale": [3, 1], "offset": [-1, 0]}}}
    textured(document, pixels, info, sampler={"wrapS": code})
    np.testing.assert_array_equal(seen(load(document, tmp_path), size=6)[0], pixels[0, columns])


def test_texture_transform_can_select_another_coordinate_set(tmp_path: Path) -> None:
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


def test_external_and_embedded_images_are_read(tmp_path: Path) -> None:
    picture = png(ARROWS)
    (tmp_path / "a b.png").write_bytes(picture)
    inside = "data:image/png;base64," + base64.b64encode(picture).decode()
    for uri in ("a%20b.png", inside):
        document = Document()
        image = document.add("images", uri=uri)
        texture = document.add("textures", source=image, sampler=document.add("samplers", magFilter=9728))
        document.node(mesh=document.square(pbrMetallicRoughness={"baseColorTexture": {"index": texture}}))
        np.testing.assert_array_equal(seen(load(document, tmp_path), size=2), ARROWS)


def test_webp_image_takes_precedence_over_its_fallback(tmp_path: Path) -> None:
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


def test_alpha_modes_mask_blend_and_opaque_are_applied(tmp_path: Path) -> None:
    """MASK cuts holes, BLEND mixes with the background, and OPAQUE ignores alpha.

    The ground truth shows the same surfaces.
    """
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


def test_single_sided_back_faces_are_hidden_and_double_sided_back_faces_shown(tmp_path: Path) -> None:
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


def test_material_variants_are_selected(tmp_path: Path) -> None:
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
    with raises(raycam.WorldError, code="unknown_name"):
        world.with_variant("bleu")


def test_emissive_model_without_lights_is_still_lit(tmp_path: Path) -> None:
    """Emissive parts do not replace the default lights.

    Other glTF viewers also light models without lights.
    """
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
        assert has_notice(frame.notices, "default_lights")
    world.add_light(type="sky", radiance=[0, 0, 0])
    dark = raycam.render(world, camera, samples=16)["color"]
    assert (dark[:, 3] < 1e-3).all(), "unless it is given light, be it none"
    assert (dark[:, 0] > [3, 1.5, -1]).all()


@pytest.mark.parametrize(
    ("lists", "code", "fact"),
    [
        ({"textures": [{"source": 9}]}, "ignored_element", "textures[0].source"),
        ({"textures": []}, "ignored_element", "baseColorTexture.index"),
        (
            {"images": [{"bufferView": 99, "mimeType": "image/png"}]},
            "unreadable_file",
            "images[0].bufferView",
        ),
        ({"images": [{"name": "nothing"}]}, "unreadable_file", "ONE_OF_MISMATCH"),
        ({"images": [{"uri": "wood.%3CUDIM%3E.png"}]}, "unreadable_file", "wood.<UDIM>.png"),
    ],
)
def test_invalid_image_reference_omits_only_the_image(
    tmp_path: Path, lists: dict[str, Any], code: str, fact: str
) -> None:
    document = Document()
    textured(document, np.full((2, 2, 3), 200, np.uint8))
    document.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = [1, 0.25, 0.5, 1]
    document.json.update(lists)
    world = load(document, tmp_path)
    assert has_notice(world.notices, code, fact), world.notices
    shown = seen(world, size=2)[0, 0] / 255
    linear = np.where(shown > 0.04045, ((shown + 0.055) / 1.055) ** 2.4, shown / 12.92)
    np.testing.assert_allclose(linear, [1, 0.25, 0.5], atol=0.01)


@pytest.mark.parametrize(
    ("key", "value", "usual"), [("wrapS", 1, 10497), ("wrapT", 10496, 10497), ("magFilter", 0, 9729)]
)
def test_invalid_sampler_value_is_replaced_by_the_default(
    tmp_path: Path, key: str, value: int, usual: int
) -> None:
    pictures = []
    for code in (value, usual):
        document = Document()
        textured(document, np.arange(48).reshape(4, 4, 3).astype(np.uint8) * 5, sampler={key: code})
        world = load(document, tmp_path)
        pictures.append(seen(world))
        facts = f"samplers[0].{key}", value, "VALUE_NOT_IN_LIST"
        assert has_notice(world.notices, "replaced_value", *facts) == (code == value)
    np.testing.assert_array_equal(*pictures)


def test_texture_with_a_missing_sampler_is_shown(tmp_path: Path) -> None:
    document = Document()
    textured(document, np.full((2, 2, 3), 200, np.uint8))
    document.json["samplers"] = []
    world = load(document, tmp_path)
    assert has_notice(world.notices, "ignored_element", "textures[0].sampler", "samplers[0]")
    np.testing.assert_array_equal(seen(world, size=2), 200)
