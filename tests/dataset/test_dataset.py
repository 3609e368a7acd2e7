"""Data sets of every format.

Equal calls write equal files, also in shards; invalid calls are refused before rendering.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam
import raycam.dataset
from raycam.dataset import FORMATS, views, write
from raycam.dataset.plan import Plan
from raycam.jobs import Job
from support.box_table import ring, table
from support.raises import raises


def quick(tmp_path: Path, **options: Any) -> raycam.dataset.DatasetResult:
    return write(table(), tmp_path, cameras=ring(3), integrator="flat", samples=1, **options)


NEEDS = {"hdf5": "h5py", "mcap": "mcap"}
HERE = [
    name
    for name in FORMATS
    if name not in ("semantickitti", "nuscenes") and (name not in NEEDS or find_spec(NEEDS[name]))
]
"""The formats of cameras; the others require a rig with a lidar."""


@pytest.mark.parametrize("name", HERE)
def test_equal_calls_and_resumed_calls_write_the_same_files(tmp_path: Path, name: str) -> None:
    def read(folder: Path) -> dict[str, bytes]:
        return {
            str(path.relative_to(folder)): path.read_bytes()
            for path in folder.rglob("*")
            if path.is_file() and ".raycam" not in path.relative_to(folder).parts
        }

    assert quick(tmp_path / "a", format=name).made > 0
    quick(tmp_path / "b", format=name, threads=1)
    whole = read(tmp_path / "a")
    assert read(tmp_path / "b") == whole

    # Interrupted after the first unit of work, the data set is resumed.
    class Stop(Exception):
        pass

    def stop(done: int, total: int, failed: int) -> None:
        if done:
            raise Stop

    with pytest.raises(Stop):
        quick(tmp_path / "c", format=name, progress=stop)
    assert not {path.name for path in (tmp_path / "c").rglob("*.json")} & {
        "instances.json",
        "transforms.json",
    }
    kept = len([path for path in (tmp_path / "c").rglob("*") if path.is_file()])
    assert 0 < kept < len(whole) + 8  # the job keeps up to 8 files of its own
    assert quick(tmp_path / "c", format=name).made == FORMATS[name].units(plan(name)) - 1
    assert Job(tmp_path / "c").verify() == {}
    assert read(tmp_path / "c") == whole
    assert quick(tmp_path / "c", format=name).made == 0


@pytest.mark.parametrize("name", HERE)
def test_options_as_numpy_scalars_equal_python_numbers(tmp_path: Path, name: str) -> None:
    known = {"baseline": 0.5, "depth_scale": 1.0}
    options = {key: known.get(key, value) for key, value in FORMATS[name].options.items()}
    numbers = {key: value for key, value in options.items() if type(value) in (int, float)}
    assert quick(tmp_path, format=name, **numbers).made > 0
    scalars = {
        key: np.float32(value) if type(value) is float else np.array(value) for key, value in numbers.items()
    }
    assert quick(tmp_path, format=name, **scalars).made == 0


def plan(name: str) -> Plan:
    return Plan(table(), views(table(), ring(3)), {}, FORMATS[name].options)


def test_invalid_data_sets_are_refused_before_rendering(tmp_path: Path) -> None:
    lens = ring(1, distortion=[-0.1, 0, 0, 0])
    for name in ("bop", "kitti", "tum", "scannet"):
        with raises(raycam.CameraError, code="unsupported_camera"):
            write(table(), tmp_path / name, name, cameras=lens)
    with raises(raycam.SettingsError, code="unknown_name", mentions=["'coco'"]):
        write(table(), tmp_path / "x", "cocco")
    with raises(raycam.SettingsError, code="unknown_key"):
        quick(tmp_path / "x", segmentatio="rle")
    with raises(raycam.SettingsError, code="invalid_value", mentions=["'mask'"]):
        quick(tmp_path / "x", segmentation="mask")
    with raises(raycam.SettingsError, code="unknown_name", mentions=["'cow'"]):
        quick(tmp_path / "x", keypoints={"cow": {}})
    with raises(raycam.SettingsError, code="wrong_shape"):
        write(table(), tmp_path / "x", cameras=ring(3), times=[0, 1])
    with raises(raycam.SettingsError, code="missing_value"):
        write(table(), tmp_path / "x", "kitti", cameras=ring(1), flow=True)
    assert list(tmp_path.iterdir()) == []
    quick(tmp_path / "y")
    with raises(
        raycam.JobError, code="changed_input", mentions=["options.segmentation", '"rle"', '"polygon"']
    ):
        quick(tmp_path / "y", segmentation="polygon")
    assert quick(tmp_path / "y", segmentation="polygon", resume=False).made == 3


def test_concurrent_shards_write_one_data_set(tmp_path: Path) -> None:
    def other(done: int, total: int, failed: int) -> None:
        if done == 1:
            assert not quick(tmp_path / "a", shard=(2, 2)).complete

    assert quick(tmp_path / "a", shard=(1, 2), progress=other).complete
    quick(tmp_path / "b")
    index = "annotations/instances.json"
    assert (tmp_path / "a" / index).read_bytes() == (tmp_path / "b" / index).read_bytes()


def test_shards_write_one_data_set(tmp_path: Path) -> None:
    one = quick(tmp_path / "a", shard=(1, 2))
    assert (one.made, one.complete) == (2, False)
    assert not (tmp_path / "a" / "annotations").exists()
    two = quick(tmp_path / "a", shard=(2, 2))
    assert (two.made, two.complete) == (1, True)
    quick(tmp_path / "b")
    for name in ("annotations/instances.json", "images/000001.png"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


@pytest.mark.parametrize("change", ["mesh", "texture"])
def test_changed_mesh_or_texture_is_refused_on_resume(tmp_path: Path, change: str) -> None:
    def files(scale: float, shade: int) -> raycam.World:
        corners = f"v 0 0 0\nv {scale} 0 0\nv 0 {scale} 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
        (tmp_path / "a.obj").write_text(corners)
        cv2.imwrite(str(tmp_path / "t.png"), np.full((4, 4, 3), shade, np.uint8))
        world = raycam.World(folder=tmp_path)
        world.add_object(mesh="a.obj", texture="t.png")
        return world

    camera = [raycam.Camera.look_at([0.2, 0.2, 3], [0.2, 0.2, 0], [0, 1, 0], size=(16, 12))]
    write(files(1.0, 80), tmp_path / "d", cameras=camera)
    assert write(files(1.0, 80), tmp_path / "d", cameras=camera).made == 0
    with raises(raycam.JobError, code="changed_input"):
        write(files(2.0 if change == "mesh" else 1.0, 81), tmp_path / "d", cameras=camera)
