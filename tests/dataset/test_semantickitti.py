"""SemanticKITTI's files, read as its API and KITTI's development kit define them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
import yaml
from raycam.dataset import write

FORWARD = [[0, -1, 0], [0, 0, -1], [1, 0, 0]]
"""camera_from_body of a camera that looks along the body's x axis."""


def street() -> raycam.World:
    world = raycam.World()
    grey = [0.5] * 3
    world.add_object(plane={"size": [80, 80]}, name="road", category="road", color=grey)
    world.add_object(
        box={"size": [4, 2, 1.5]}, name="car", location=[12, 3, 0.75], category="car", color=grey
    )
    world.add_object(box={"size": [1, 1, 6]}, name="post", location=[9, -4, 3], color=grey)
    world.add_light("sky", radiance=1)
    return world


def vehicle(**settings: Any) -> raycam.Rig:
    camera = raycam.Camera([[60, 0, 40], [0, 60, 30], [0, 0, 1]], FORWARD, [0.5, 0, 1.2], (80, 60))
    lidar = raycam.Lidar("vlp16", noise=False, **settings).placed([0, 0, 1.8], yaw=5)
    return raycam.Rig({"camera": camera, "top": lidar})


def drive() -> tuple[list[raycam.Rig], list[float]]:
    rig = vehicle()
    return [rig.placed([i * 1.0, i * 0.2, 0], yaw=3 * i) for i in range(3)], [0.0, 0.1, 0.2]


def matrices(path: Path) -> Any:
    rows = np.loadtxt(path).reshape(-1, 3, 4)
    return np.concatenate([rows, np.tile([[[0, 0, 0, 1.0]]], (len(rows), 1, 1))], axis=1)


def test_points_lie_on_the_objects_that_their_labels_name(tmp_path: Path) -> None:
    """Velodyne points are converted to the world by Tr and the poses."""
    rigs, times = drive()
    world = street()
    ids = {"car": 10, "road": 40}
    write(world, tmp_path, "semantickitti", cameras=rigs, times=times, samples=1, labels=ids)
    base = tmp_path / "sequences" / "00"
    rows = dict(line.split(": ") for line in (base / "calib.txt").read_text().splitlines())
    tr = np.eye(4)
    tr[:3] = np.array(rows["Tr"].split(), float).reshape(3, 4)
    poses = matrices(base / "poses.txt")
    assert (tmp_path / "poses" / "00.txt").read_bytes() == (base / "poses.txt").read_bytes()
    np.testing.assert_allclose(poses[0], np.eye(4), atol=1e-12)
    np.testing.assert_allclose(np.loadtxt(base / "times.txt"), times, atol=1e-9)
    first = rigs[0]["camera"]
    start = np.eye(4)
    start[:3, :3], start[:3, 3] = first.R.T, first.C
    for number in range(3):
        points = np.fromfile(base / "velodyne" / f"{number:06d}.bin", np.float32).reshape(-1, 4)
        label = np.fromfile(base / "labels" / f"{number:06d}.label", np.uint32)
        assert len(points) == len(label) > 5000
        local = np.column_stack([points[:, :3], np.ones(len(points))])
        at = (start @ poses[number] @ tr @ local.T).T[:, :3]
        semantic, instance = label & 0xFFFF, label >> 16
        for name, kind, index in (("road", 40, 0), ("car", 10, 1), ("post", 0, 2)):
            chosen = instance == index + 1
            assert chosen.any(), name
            assert (semantic[chosen] == kind).all()
            apart = world.closest_points(at[chosen], objects=[name])["distance"]
            assert apart.max() < 1e-4  # the tolerance for float32 values
    names = yaml.safe_load((tmp_path / "labels.yaml").read_text())["labels"]
    assert names == {0: "unlabeled", 10: "car", 40: "road"}


def test_lidar_moves_between_the_poses_of_the_rig(tmp_path: Path) -> None:
    """Without this motion, points of the turning lidar would be centimetres from the post."""
    rigs, times = drive()
    views = raycam.dataset.views(street(), rigs, times)
    for number, view in enumerate(views):
        lidar = view.sensors["top"]
        assert isinstance(lidar, raycam.Lidar)
        assert lidar.is_moving
        turns, places = lidar.track.at(np.array([0.0, 0.1]))
        own = rigs[number].sensors["top"].pose
        np.testing.assert_allclose(places[0], own[:3, 3], atol=1e-12)
        if number < 2:
            following = rigs[number + 1].sensors["top"].pose
            np.testing.assert_allclose(places[1], following[:3, 3], atol=1e-9)
            np.testing.assert_allclose(turns[1], following[:3, :3], atol=1e-9)
        else:  # after the last pose, the rig continues its last motion
            assert np.linalg.norm(places[1] - places[0]) == pytest.approx(np.hypot(1, 0.2), rel=0.05)


def test_data_set_does_not_depend_on_the_number_of_workers(tmp_path: Path) -> None:
    rigs, times = drive()
    for name, workers in (("a", None), ("b", 2)):
        write(
            street(), tmp_path / name, "semantickitti", cameras=rigs, times=times, samples=1, workers=workers
        )
    files = [path.relative_to(tmp_path / "a") for path in (tmp_path / "a" / "sequences").rglob("*.*")]
    assert len(files) == 12
    for path in files:
        assert (tmp_path / "a" / path).read_bytes() == (tmp_path / "b" / path).read_bytes()


def test_views_without_a_lidar_are_refused(tmp_path: Path) -> None:
    camera = vehicle()["camera"]
    two = raycam.Rig({"camera": camera, "a": raycam.Lidar("vlp16"), "b": raycam.Lidar("vlp16")})
    for cameras, options, code in (
        ([camera], {}, "missing_value"),
        (raycam.Rig({"camera": camera}), {}, "missing_value"),
        (two, {}, "missing_value"),
        (two, {"lidar": "c"}, "unknown_name"),
        (vehicle(), {"labels": {"bus": 1}}, "unknown_name"),
        (vehicle(), {"labels": {"car": 1 << 16}}, "out_of_range"),
        (vehicle(), {"fps": 0}, "out_of_range"),
        (vehicle(), {"sequence": "../x"}, "invalid_value"),
    ):
        with pytest.raises(raycam.SettingsError) as caught:
            write(street(), tmp_path, "semantickitti", cameras=cameras, **options)  # type: ignore[arg-type]
        assert caught.value.code == code
