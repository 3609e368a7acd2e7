"""Large pictures in tiles: the bits of the whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from job_frames import Pool
from raycam import tiles
from raycam.cluster import pool_of
from raycam.errors import JobError
from raycam.jobs import Job


def test_tiles_join_to_the_bits_of_the_whole(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(torus={"radius": 1, "tube": 0.4})
    world.add_object(plane={"size": [8, 8]}, location=[0, 0, -0.5])
    world.add_light({"type": "sun", "direction": [-1, 1, -2], "irradiance": [3, 3, 3]})
    world.add_camera(raycam.Camera.look_at([3, -2, 2], [0, 0, 0], size=(61, 43), fov=45), "picture-0")
    camera = raycam.Camera.look_at([2, -3, 2], [0, 0, 0], size=(61, 43), fov=45)
    options = {
        "samples": 5,
        "filter": "blackman-harris",
        "seed": 4,
        "exposure": 1.5,
        "channels": ["color", "depth", "instance"],
    }
    whole = raycam.render(world, camera, **options)
    job = Job(tmp_path, tiles.package(world, camera, tile=16, **options))
    job.run(Pool(), frames=range(0, 12, 5))
    with pytest.raises(JobError, match="3 of 12 tiles are finished"):
        tiles.join(job)
    with pool_of(2) as pool:
        job.run(pool)
    picture = tiles.join(Job(tmp_path))
    assert list(picture) == list(whole)
    for name in whole:
        np.testing.assert_array_equal(picture[name], whole[name])
    assert picture.to_png() == whole.to_png()
    assert picture.camera == camera
