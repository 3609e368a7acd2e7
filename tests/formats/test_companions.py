"""Files named by other files: root folders, symbolic links, placeholders and image search."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from support.raises import has_notice, raises

OBJ = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n"
POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a214614ab2935\nsize 12345\n"


def write_obj(folder: Path, image: str = "a.png") -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "a.obj").write_text(OBJ)
    (folder / "a.mtl").write_text(f"newmtl m\nKd 0 0 1\nmap_Kd {image}\n")


def write_gltf(folder: Path, buffer: str = "a.bin", image: str = "a.png") -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "a.bin").write_bytes(struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0))
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"uri": image}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 3,
                "type": "VEC3",
                "min": [0, 0, 0],
                "max": [1, 1, 0],
            }
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"uri": buffer, "byteLength": 36}],
    }
    (folder / "a.gltf").write_text(json.dumps(document))


def write_image(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.full((2, 2, 3), 200, np.uint8)).save(path)


def blob(link: Path, blobs: Path) -> None:
    """Moves a file to another folder and puts a symbolic link in its place.

    The moved file has no extension.
    """
    blobs.mkdir(parents=True, exist_ok=True)
    target = blobs / f"{abs(hash(link.name)):x}"
    link.rename(target)
    link.symlink_to(target)


@pytest.mark.parametrize("kind", ["obj", "gltf"])
def test_symbolic_links_into_one_folder_are_read(tmp_path: Path, kind: str) -> None:
    """As in the cache of Hugging Face: snapshots contain links into one folder of blobs."""
    snapshot = tmp_path / "snapshots" / "main"
    write_obj(snapshot) if kind == "obj" else write_gltf(snapshot)
    write_image(snapshot / "a.png")
    for file in list(snapshot.iterdir()):
        blob(file, tmp_path / "blobs")
    world = raycam.load(snapshot / f"a.{kind}")
    assert world.counts["textures"] == 1
    assert not has_notice(world.notices, "missing_file")


def test_symbolic_links_outside_the_root_give_a_notice_with_the_remedy(tmp_path: Path) -> None:
    """As in git-annex: each linked file is in its own folder."""
    model = tmp_path / "data" / "model"
    write_obj(model)
    write_gltf(model)
    write_image(model / "a.png")
    for file in list(model.iterdir()):
        blob(file, tmp_path / "objects" / file.name)
    world = raycam.load(model / "a.obj")
    assert has_notice(world.notices[:1], "outside_root", f'folder="{tmp_path.resolve()}"')
    with raises(raycam.FormatError, code="outside_root", mentions=["folder="]):
        raycam.load(model / "a.gltf")
    for name in ("a.obj", "a.gltf"):
        world = raycam.load(model / name, folder=tmp_path)
        assert world.counts["textures"] == 1, world.notices
    with raises(raycam.SettingsError, code="outside_root"):
        raycam.load(model / "a.obj", folder=tmp_path / "objects" / "a.png")


@pytest.mark.parametrize("target", [".git/annex/objects/xx/MD5E-s1.png", "../gone/b.png", "a.png"])
@pytest.mark.parametrize("kind", ["obj", "gltf"])
def test_broken_symbolic_link_is_reported(tmp_path: Path, kind: str, target: str) -> None:
    write_obj(tmp_path) if kind == "obj" else write_gltf(tmp_path)
    path = tmp_path / f"a.{kind}"
    (tmp_path / "a.png").symlink_to(target)
    world = raycam.load(path)
    code = "missing_file" if kind == "obj" else "unreadable_file"
    assert has_notice(world.notices, code, "a.png", target)
    path.unlink()
    path.symlink_to(f"../gone/{path.name}")
    with raises(FileNotFoundError, code="file_not_found", mentions=["../gone/"]):
        raycam.load(path)


def test_wider_root_folder_allows_files_of_sibling_folders(tmp_path: Path) -> None:
    """As in models of Gazebo: meshes next to materials/textures."""
    meshes = tmp_path / "model" / "meshes"
    write_image(tmp_path / "model" / "materials" / "textures" / "wood.png")
    for image in ("../materials/textures/wood.png", "wood.png", r"C:\me\textures\wood.png"):
        write_obj(meshes, image)
        narrow = raycam.load(meshes / "a.obj")
        assert narrow.counts["textures"] == 0
        code = "missing_file" if image == "wood.png" else "outside_root"
        assert has_notice(narrow.notices, code, "wood.png")
        wide = raycam.load(meshes / "a.obj", folder=tmp_path / "model")
        assert wide.counts["textures"] == 1, wide.notices
        assert bool(wide.notices) == (not image.startswith("..")), wide.notices
    world = raycam.World(folder=tmp_path / "model")
    world.add_object(mesh="meshes/a.obj")
    assert world.counts["textures"] == 1
    # A world file in a subfolder of its root.
    scenes = tmp_path / "model" / "scenes"
    scenes.mkdir()
    (scenes / "room.toml").write_text('[[object]]\nmesh = "../meshes/a.obj"\n')
    with raises(raycam.FormatError, code="outside_root", mentions=["folder="]):
        raycam.load(scenes / "room.toml")
    assert raycam.load(scenes / "room.toml", folder=tmp_path / "model").counts["textures"] == 1


def test_time_argument_requires_a_usd_file(tmp_path: Path) -> None:
    write_obj(tmp_path)
    with raises(raycam.SettingsError, code="conflicting_values", mentions=["time=", "USD"]):
        raycam.load(tmp_path / "a.obj", time=1.0)


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (POINTER, "placeholder_file"),
        (b"<!DOCTYPE html>\n<html><body>404</body></html>", "placeholder_file"),
        (b"", "empty_file"),
    ],
)
def test_errors_about_pointer_files_and_web_pages_name_the_file(
    tmp_path: Path, content: bytes, code: str
) -> None:
    for kind in ("toml", "gltf", "glb", "obj", "ply", "stl", "off"):
        path = tmp_path / f"x.{kind}"
        path.write_bytes(content)
        if kind != "toml" or content:
            with raises(raycam.FormatError, code=code, mentions=[path.name]):
                raycam.load(path)
    with raises(raycam.FormatError, code=code, mentions=["x.toml"]):
        raycam.Recipe(tmp_path / "x.toml")
    write_gltf(tmp_path)
    write_image(tmp_path / "a.png")
    (tmp_path / "a.bin").write_bytes(content)
    with raises(raycam.FormatError, code=code, mentions=["a.bin"]):
        raycam.load(tmp_path / "a.gltf")
    write_gltf(tmp_path)
    (tmp_path / "a.png").write_bytes(content)
    world = raycam.load(tmp_path / "a.gltf")
    assert has_notice(world.notices, "unreadable_file", "a.png"), world.notices


@pytest.mark.parametrize(
    ("name", "mode", "options"),
    [
        ("a.tif", "RGB", {}),
        ("a.tif", "RGB", {"compression": "tiff_lzw"}),
        ("a.tiff", "RGBA", {"compression": "tiff_adobe_deflate"}),
        ("a.tif", "L", {"compression": "packbits"}),
        ("a.gif", "P", {}),
    ],
)
def test_tiff_and_gif_images_of_pillow_are_read(
    tmp_path: Path, name: str, mode: str, options: dict[str, str]
) -> None:
    random = np.random.default_rng(3)
    pixels = random.integers(0, 256, (6, 5, 4), np.uint8)
    if mode != "RGBA":
        pixels[..., 3] = 255
    picture = Image.fromarray(pixels, "RGBA").convert("RGB" if mode == "P" else mode)
    picture = picture.quantize(16) if mode == "P" else picture
    picture.save(tmp_path / name, **options)
    with Image.open(tmp_path / name) as opened:
        expected = np.asarray(opened.convert("RGBA"))
    camera = raycam.Camera.look_at([0, 0, 4], [0, 0, 0], up=[0, 1, 0], size=(40, 40), fov=60)

    def shown(image: Any) -> np.ndarray:
        world = raycam.World()
        world.add_object(
            plane={"size": [5, 6]}, type="unlit", texture=raycam.Texture(image, filter="nearest")
        )
        return raycam.render(world, camera, integrator="flat", samples=1)["color"]

    np.testing.assert_array_equal(shown(tmp_path / name), shown(expected))
    data = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(data[: len(data) // 2])
    with pytest.raises(raycam.FormatError):
        shown(tmp_path / name)


def test_image_alpha_applies_to_files_and_arrays(tmp_path: Path) -> None:
    pixels = np.full((2, 2, 4), 255, np.uint8)
    pixels[:, 1, 3] = 0
    Image.fromarray(pixels, "RGBA").save(tmp_path / "a.png")
    camera = raycam.Camera.look_at([0, 0, 3], [0, 0, 0], up=[0, 1, 0], size=(20, 20), fov=40)
    for image in (pixels, tmp_path / "a.png", pixels / 255.0):
        cases: list[tuple[dict[str, Any], float]] = [
            ({}, 0.5),
            ({"alpha": "opaque"}, 1.0),
            ({"opacity": 1.0}, 0.5),
            ({"alpha": "blend"}, 0.5),
        ]
        for alpha, there in cases:
            world = raycam.World()
            texture = raycam.Texture(image, filter="nearest")
            world.add_object(plane={"size": 8}, type="unlit", texture=texture, **alpha)
            seen = raycam.render(world, camera, samples=4, channels=["alpha"])["alpha"]
            assert seen.mean() == pytest.approx(there, abs=0.06), (alpha, type(image))
    with raises(raycam.WorldError, code="conflicting_values"):
        raycam.World().add_object(plane={}, alpha="opaque", opacity=0.5)
