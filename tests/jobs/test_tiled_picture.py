"""Large images rendered in tiles equal whole images bit for bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.cli import main
from raycam.cluster import make_pool
from raycam.errors import JobError, SettingsError
from raycam.jobs import Job, tiled_picture
from support.job_frames import Pool
from support.raises import Fault, fault, raises


def test_joined_tiles_equal_the_whole_image_bit_for_bit(tmp_path: Path) -> None:
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
    job = Job(tmp_path, tiled_picture.job_package(world, camera, tile=16, **options))
    job.run(Pool(), frames=range(0, 12, 5))
    with raises(JobError, code="unfinished_job", mentions=["12"]):
        tiled_picture.assemble(job)
    with make_pool(2) as pool:
        job.run(pool)
    picture = tiled_picture.assemble(Job(tmp_path))
    assert list(picture) == list(whole)
    for name in whole:
        np.testing.assert_array_equal(picture[name], whole[name])
    assert picture.to_png() == whole.to_png()
    assert picture.camera == camera


def test_tiled_rendering_keeps_regions_views_and_transparency(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(torus={"radius": 1, "tube": 0.4})
    world.add_light({"type": "sky", "radiance": [3, 2, 1]})
    camera = raycam.Camera.look_at([2, -3, 2], [0, 0, 0], size=(61, 43), fov=45)
    options: dict[str, Any] = {
        "samples": 4,
        "region": (7, 5, 40, 31),
        "view": "agx",
        "transparent_background": True,
        "channels": ["color", "depth"],
    }
    whole = raycam.render(world, camera, **options)
    plan = tiled_picture.job_package(world, camera, tile=16, **options)
    assert plan.frames == 3 * 2
    assert tiled_picture.render_tiled(plan, tmp_path, Pool(), shard=(1, 2)) is None
    picture = tiled_picture.render_tiled(plan, tmp_path, Pool(), shard=(2, 2))
    assert picture is not None
    assert picture.region == whole.region == (7, 5, 40, 31)
    assert list(picture) == list(whole) == ["color", "depth", "alpha"]
    for name in whole:
        np.testing.assert_array_equal(picture[name], whole[name])
    assert picture.to_png() == whole.to_png()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"time_limit": 3.0}, fault("conflicting_values", "time_limit")),
        ({"denoise": True}, fault("conflicting_values", "noise_threshold")),
        ({"region": (0, 0, 62, 43)}, fault("out_of_range")),
        ({"region": (-1, 0, 5, 5)}, fault("out_of_range")),
    ],
)
def test_options_incompatible_with_tiles_are_refused(options: dict[str, Any], message: Fault) -> None:
    world = raycam.World()
    world.add_object(box={"size": 1})
    camera = raycam.Camera.look_at([2, -3, 2], [0, 0, 0], size=(61, 43), fov=45)
    with raises(SettingsError, **message):
        tiled_picture.job_package(world, camera, **options)


def test_workers_and_shards_options_write_the_same_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tiled_picture, "DEFAULT_TILE", 32)
    Path("box.toml").write_text(WORLD)
    assert main(["render", "box.toml", "-o", "one.exr"]) == 0
    assert main(["render", "box.toml", "-o", "two.exr", "--workers", "2"]) == 0
    assert main(["render", "box.toml", "-o", "three.exr", "--shard", "1/2"]) == 0
    assert "shard 1/2 is finished; three.exr" in capsys.readouterr().out
    assert Path("three.exr.job").is_dir()
    assert main(["render", "box.toml", "-o", "three.exr", "--shard", "2/2"]) == 0
    assert Path("one.exr").read_bytes() == Path("two.exr").read_bytes() == Path("three.exr").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["box.toml", "one.exr", "three.exr", "two.exr"]
    assert main(["render", "box.toml", "-o", "a.png", "--workers", "0"]) == 2
    assert main(["render", "box.toml", "-o", "a.png", "--retry-failed"]) == 2
    assert "--workers" in capsys.readouterr().err


WORLD = """
[camera]
size = [64, 48]
fov = 40
location = [3, -4, 2]
target = [0, 0, 0]
[[object]]
box = { size = 1 }
color = "#c83c28"
"""
