"""Textures larger than the memory limit.

The images are equal, the memory stays within the limit, and errors contain remedies.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from support.raises import has_notice, raises

SIZE = (96, 64)
CAMERA = raycam.Camera.look_at([0.5, -5, 2], [0, 0, 0.4], up=[0, 0, 1], size=SIZE, fov=40)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with images of odd sizes in a world file, an OBJ file and a glTF file.

    The images have 8 bits, 16 bits or floats.
    """
    folder = tmp_path_factory.mktemp("textures")
    random = np.random.default_rng(1)
    Image.fromarray(random.integers(0, 256, (203, 310, 3), np.uint8)).save(folder / "noise.png")
    Image.fromarray(random.integers(0, 256, (129, 65, 4), np.uint8), "RGBA").save(folder / "packed.png")
    Image.fromarray(random.integers(0, 65536, (77, 140), np.uint16)).save(folder / "rough.png")
    world = raycam.World()
    world.add_object(plane={"size": 1}, texture=random.random((70, 90, 3)))
    world.to_gltf(folder / "tile.glb")
    (folder / "sheet.mtl").write_text("newmtl m\nKd 1 1 1\nmap_Kd noise.png\nmap_Bump rough.png\n")
    (folder / "sheet.obj").write_text(
        "mtllib sheet.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 3 0\nvt 3 3\nf 1/1 2/2 3/3\n"
    )
    (folder / "world.toml").write_text(
        """
        [[object]]
        plane = { size = 8 }
        type = "principled"
        texture = { image = "noise.png", repeat = 5, wrap = "mirror" }
        textures.roughness = { image = "rough.png", channel = "red" }
        textures.normal = "packed.png"
        textures.metallic = "packed.png"

        [[object]]
        mesh = "tile.glb"
        location = [-0.5, 0, 0.5]

        [[object]]
        mesh = "sheet.obj"
        location = [0.2, 0, 0.5]

        [[light]]
        type = "sky"
        radiance = [1, 1, 1]
        """
    )
    return folder


def picture(world: raycam.World, **settings: Any) -> dict[str, np.ndarray]:
    frame = raycam.render(
        world, CAMERA, **{"integrator": "path", "samples": 4, "channels": ["color", "albedo"], **settings}
    )
    return {name: frame[name] for name in ("color", "albedo")}


@pytest.mark.parametrize("limit", [1, 5000, "100 KiB", "1 MiB", 1 << 40])
def test_texture_memory_does_not_change_the_image(folder: Path, limit: int | str) -> None:
    expected = picture(raycam.load(folder / "world.toml"))
    world = raycam.load(folder / "world.toml", texture_memory=limit)
    paged = any(notice.code == "exceeded_texture_memory" for notice in world.notices)
    assert paged == (limit != 1 << 40)
    for threads in (1, 2, 5):
        for name, found in picture(world, threads=threads).items():
            assert found.tobytes() == expected[name].tobytes(), f"{name} with {threads} threads"


def test_texture_memory_applies_to_every_image_format_and_arrays(folder: Path) -> None:
    for name in ("sheet.obj", "tile.glb"):
        world = raycam.load(folder / name, texture_memory=1000)
        assert "temporary file" in "".join(map(str, world.notices)), name
        limited, whole = (picture(w, samples=1) for w in (world, raycam.load(folder / name)))
        assert limited["albedo"].tobytes() == whole["albedo"].tobytes()
    by_hand = [raycam.World(texture_memory=limit) for limit in (None, 200_000)]
    for seed in range(4):
        for world in by_hand:
            texels = np.random.default_rng(seed).integers(0, 256, (130, 130, 3), np.uint8)
            world.add_object(plane={"size": 1}, location=[seed - 1.5, 0, 0.1], texture=texels)
    for world in by_hand:  # this mesh file is in another folder and names further files
        world.add_object(mesh=str(folder / "sheet.obj"), location=[0, 1, 0.2])
    assert [world.texture_memory for world in by_hand] == [None, 200_000]
    first, second = (picture(world) for world in by_hand)
    assert first["color"].tobytes() == second["color"].tobytes()
    assert by_hand[0].notices == by_hand[1].notices[1:]


def test_frame_reports_the_amount_of_texture_data_read_back(folder: Path) -> None:
    told = [
        raycam.render(raycam.load(folder / "world.toml", texture_memory=limit), CAMERA, samples=1).notices
        for limit in ("10 KiB", None)
    ]
    assert has_notice(told[0], "textures_paged")
    assert not has_notice(told[1], "textures_paged")


def test_world_from_bytes_is_refused_beyond_texture_memory(folder: Path) -> None:
    whole = raycam.load(folder / "world.toml")
    fits = raycam.load(folder / "world.toml", texture_memory="64 MiB")
    assert fits.to_bytes() == whole.to_bytes()
    with raises(raycam.WorldError, code="invalid_world", mentions=["texture_memory"]):
        raycam.load(folder / "world.toml", texture_memory="10 KiB").to_bytes()
    again = raycam.World.from_bytes(whole.to_bytes(), texture_memory="10 KiB")
    assert picture(again)["color"].tobytes() == picture(whole)["color"].tobytes()


@pytest.mark.parametrize("limit", [0, -1, "lots", "5 parsec", True, "0 MiB"])
def test_invalid_texture_memory_is_refused(limit: int | str) -> None:
    with raises(raycam.SettingsError, code="wrong_type", mentions=["texture_memory"]):
        raycam.World(texture_memory=limit)


def run(script: str, *arguments: str, **environment: str) -> Any:
    found = subprocess.run(
        [sys.executable, "-c", script, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(found.stdout)


def test_full_disk_raises_with_the_temporary_folder(folder: Path, tmp_path: Path) -> None:
    script = """
import json, resource, sys, raycam
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
try:
    raycam.load(sys.argv[1], texture_memory=1000)
except OSError as error:
    print(json.dumps([type(error).__name__, error.errno, error.filename, str(error)]))
"""
    world = str(folder / "world.toml")
    _, number, where, text = run(script, world, TMPDIR=str(tmp_path))
    assert (number, where) == (27, str(tmp_path)), text  # EFBIG simulates a full disk
    assert "TMPDIR" in text
    assert "raise texture_memory" in text
    missing = tmp_path / "missing"
    kind, _, where, _ = run(script, world, TMPDIR=str(missing))
    assert (kind, where) == ("FileNotFoundError", str(missing))
    assert list(tmp_path.iterdir()) == []


def test_process_memory_stays_near_the_limit(tmp_path: Path) -> None:
    """Twelve large images need 32 MiB plus the memory to decode one of them.

    They have 2048 x 2048 pixels each, 320 MiB with mip maps.
    """
    random = np.random.default_rng(0)
    texels = np.repeat(np.repeat(random.integers(0, 256, (512, 512, 3), np.uint8), 4, 0), 4, 1)
    for i in range(12):
        Image.fromarray(np.roll(texels, i, 0)).save(tmp_path / f"{i}.png", compress_level=1)
    script = """
import json, sys, raycam
def peak():
    return int(open("/proc/self/status").read().split("VmHWM:")[1].split()[0]) >> 10
world = raycam.World(folder=sys.argv[1], texture_memory=sys.argv[2] or None)
camera = raycam.Camera.look_at([0, 0, 9], [0, 0, 0], up=[0, 1, 0], size=(256, 192), fov=40)
raycam.render(world, camera, integrator="path", samples=1)
before = peak()
for i in range(12):
    world.add_object(plane={"size": 1.6}, location=[i % 4 * 1.7 - 2.5, i // 4 * 1.7 - 1.7, 0], texture=f"{i}.png")
loaded = peak() - before
frame = raycam.render(world, camera, integrator="path", samples=4)
print(json.dumps([loaded, peak() - before, frame["color"].tobytes().hex()[:4000]]))
"""
    loaded, rendered, picture = run(script, str(tmp_path), "32 MiB")
    # Decoding needs the file, two copies of its texels (16 MiB each), and half as much for the first mip level.
    assert loaded < 32 + 56, f"{loaded} MiB"
    assert rendered < 32 + 64, f"{rendered} MiB"
    whole, _, same = run(script, str(tmp_path), "")
    assert whole > 180, f"{whole} MiB without a limit: the test tells nothing"
    assert picture == same
