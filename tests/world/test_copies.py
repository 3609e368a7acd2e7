"""Independent copies of worlds.

They are created by `copy`, `deepcopy` and pickle, or sent to other processes.
"""

from __future__ import annotations

import copy
import multiprocessing
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import raycam

CAMERA = raycam.Camera.look_at([3, -4, 2], [0, 0, 0], [0, 0, 1], size=(40, 30), fov=40)
WAYS: dict[str, Callable[[raycam.World], raycam.World]] = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda world: pickle.loads(pickle.dumps(world)),
    "pickle 2": lambda world: pickle.loads(pickle.dumps(world, protocol=2)),
}


def textured_world(folder: Path | None = None) -> raycam.World:
    world = raycam.World("y", folder=folder, texture_memory="64 MiB")
    texels = np.random.default_rng(1).integers(0, 256, (8, 8, 3), dtype=np.uint8)
    world.add_object(box={"size": 1}, texture=raycam.Texture(texels), name="box", category="thing")
    world.add_light(type="sun", direction=[-1, 1, -2], irradiance=[3, 3, 3])
    world.add_camera(CAMERA, "eye")
    return world


def picture(world: raycam.World) -> bytes:
    return raycam.render(world, CAMERA, samples=4, channels="color")["color"].tobytes()


def picture_in_child(world: raycam.World) -> bytes:
    return picture(world)


@pytest.mark.parametrize("way", WAYS)
def test_copy_is_equal_and_independent(way: str) -> None:
    world = textured_world()
    seen = picture(world)
    other = WAYS[way](world)
    assert other.up == "y"
    assert other.texture_memory == world.texture_memory
    assert other.to_bytes() == world.to_bytes()
    assert picture(other) == seen
    other.add_object(sphere={"radius": 0.9}, location=[0, 0, 1])
    other.add_camera(CAMERA, "second")
    assert [len(world.objects), len(world.cameras)] == [1, 1]
    assert picture(world) == seen != picture(other)
    world.add_light(type="sky", radiance=[1, 1, 1])
    assert len(other.lights) == 1


@pytest.mark.parametrize("way", WAYS)
def test_copy_finds_files_in_the_folder_of_the_world(way: str, tmp_path: Path) -> None:
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    other = WAYS[way](textured_world(tmp_path))
    other.add_object(mesh="flat.obj")
    assert other.objects[1].triangles == 1


def test_worlds_are_sent_to_spawned_processes() -> None:
    world = textured_world()
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(picture_in_child, [world]) == picture(world)
