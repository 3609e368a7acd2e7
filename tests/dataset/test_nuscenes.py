"""nuScenes's tables, read as in the devkit.

Every token resolves, and boxes contain the points of their objects.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from dataset.test_semantickitti import FORWARD, street
from PIL import Image
from raycam.dataset import write
from scipy.spatial.transform import Rotation

TABLES = (
    *(
        "category",
        "attribute",
        "visibility",
        "instance",
        "sensor",
        "calibrated_sensor",
        "ego_pose",
        "log",
        "scene",
    ),
    *("sample", "sample_data", "sample_annotation", "map"),
)
LINKS = {
    "instance": {"category_token": "category", "first_annotation_token": "sample_annotation"},
    "calibrated_sensor": {"sensor_token": "sensor"},
    "scene": {"log_token": "log", "first_sample_token": "sample", "last_sample_token": "sample"},
    "sample": {"scene_token": "scene", "prev": "sample", "next": "sample"},
    "sample_data": {
        **{
            "sample_token": "sample",
            "ego_pose_token": "ego_pose",
            "prev": "sample_data",
            "next": "sample_data",
        },
        "calibrated_sensor_token": "calibrated_sensor",
    },
    "sample_annotation": {
        **{"sample_token": "sample", "instance_token": "instance", "visibility_token": "visibility"},
        **{"prev": "sample_annotation", "next": "sample_annotation"},
    },
}


def rig() -> raycam.Rig:
    ahead = raycam.Camera([[60, 0, 40], [0, 60, 30], [0, 0, 1]], FORWARD, [0.5, 0, 1.2], (80, 60))
    left = ahead.at_pose(
        np.array(FORWARD) @ Rotation.from_euler("z", -90, degrees=True).as_matrix(), [0, 0.5, 1.2]
    )
    lidar = raycam.Lidar("hdl32e", noise=False, min_range=0).placed([0, 0, 1.8], yaw=-90)
    return raycam.Rig({"CAM_FRONT": ahead, "CAM_FRONT_LEFT": left, "LIDAR_TOP": lidar})


def drive() -> tuple[list[raycam.Rig], list[float]]:
    poses = [rig().placed([i * 0.5, 0, 0], yaw=2 * i) for i in range(5)]
    return poses, [0.05 * i for i in range(5)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("nuscenes")
    poses, times = drive()
    write(street(), path, "nuscenes", cameras=poses, times=times, samples=1, key_every=2)
    return path


@pytest.fixture(scope="module")
def tables(folder: Path) -> dict[str, list[dict[str, Any]]]:
    return {name: json.loads((folder / "v1.0-mini" / f"{name}.json").read_text()) for name in TABLES}


def matrix(row: dict[str, Any]) -> Any:
    w, x, y, z = row["rotation"]
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = Rotation.from_quat([x, y, z, w]).as_matrix(), row["translation"]
    return found


def test_every_token_is_unique_and_resolves(tables: dict[str, list[dict[str, Any]]]) -> None:
    known = {name: {row["token"] for row in rows} for name, rows in tables.items()}
    for name, rows in tables.items():
        assert len(known[name]) == len(rows)
        for key, target in LINKS.get(name, {}).items():
            for row in rows:
                assert row[key] in known[target] or (key in ("prev", "next") and row[key] == ""), (name, key)
    assert len(tables["sample"]) == 3
    assert tables["scene"][0]["nbr_samples"] == 3
    assert len(tables["sample_data"]) == len(tables["ego_pose"]) == 15
    assert sum(row["is_key_frame"] for row in tables["sample_data"]) == 9
    assert [row["timestamp"] for row in tables["sample"]] == [0, 100_000, 200_000]


def test_files_exist_with_their_sizes(folder: Path, tables: dict[str, list[dict[str, Any]]]) -> None:
    for row in tables["sample_data"]:
        path = folder / row["filename"]
        assert path.parts[-3] == ("samples" if row["is_key_frame"] else "sweeps")
        if row["fileformat"] == "png":
            with Image.open(path) as picture:
                assert picture.size == (row["width"], row["height"])
        else:
            assert path.stat().st_size % 20 == 0
    assert (folder / tables["map"][0]["filename"]).exists()


def test_points_lie_on_surfaces_and_are_counted_in_the_boxes(
    folder: Path, tables: dict[str, list[dict[str, Any]]]
) -> None:
    """Points are converted from sensor to body to world coordinates, as in the devkit.

    The devkit's functions are `LidarPointCloud` and `get_sample_data`.
    """
    rows = {name: {row["token"]: row for row in table} for name, table in tables.items()}
    world = street()
    channel = {
        row["token"]: rows["sensor"][row["sensor_token"]]["channel"] for row in tables["calibrated_sensor"]
    }
    for row in tables["sample_data"]:
        if row["fileformat"] != "pcd" or not row["is_key_frame"]:
            continue
        assert channel[row["calibrated_sensor_token"]] == "LIDAR_TOP"
        points = np.fromfile(folder / row["filename"], np.float32).reshape(-1, 5)
        assert set(np.unique(points[:, 4])) <= set(range(32))
        pose = matrix(rows["ego_pose"][row["ego_pose_token"]]) @ matrix(
            rows["calibrated_sensor"][row["calibrated_sensor_token"]]
        )
        at = points[:, :3] @ pose[:3, :3].T + pose[:3, 3]
        assert world.closest_points(at)["distance"].max() < 1e-4
        boxes = [box for box in tables["sample_annotation"] if box["sample_token"] == row["sample_token"]]
        categories = {
            rows["category"][rows["instance"][box["instance_token"]]["category_token"]]["name"]
            for box in boxes
        }
        assert categories == {"car", "road"}
        (car,) = [box for box in boxes if box["size"] == pytest.approx([2, 4, 1.5])]
        np.testing.assert_allclose(car["translation"], [12, 3, 0.75], atol=1e-9)
        back = np.linalg.inv(matrix(car))
        local = at @ back[:3, :3].T + back[:3, 3]
        width, length, height = car["size"]
        inside = (np.abs(local) <= np.array([length, width, height]) / 2 + 1e-3).all(axis=1)
        above = at[:, 2] > 1e-3  # excludes points on the road under the car's lower edge
        assert (inside & above).sum() == pytest.approx(car["num_lidar_pts"], abs=2)
        assert car["num_lidar_pts"] > 20


def test_camera_projects_the_box_of_the_car_onto_its_pixels(
    folder: Path, tables: dict[str, list[dict[str, Any]]]
) -> None:
    rows = {name: {row["token"]: row for row in table} for name, table in tables.items()}
    for row in tables["sample_data"]:
        mount = rows["calibrated_sensor"][row["calibrated_sensor_token"]]
        if rows["sensor"][mount["sensor_token"]]["channel"] != "CAM_FRONT" or not row["is_key_frame"]:
            continue
        pose = matrix(rows["ego_pose"][row["ego_pose_token"]]) @ matrix(mount)
        local = np.linalg.inv(pose) @ [12, 3, 0.75, 1]
        pixel = np.array(mount["camera_intrinsic"]) @ local[:3]
        number = row["timestamp"] // 50_000
        camera = drive()[0][number]["CAM_FRONT"]
        frame = raycam.render(street(), camera, channels=["instance"])
        u, v = np.rint(pixel[:2] / pixel[2]).astype(int)
        assert frame["instance"][v, u] == 1


def test_visibility_is_the_bin_of_the_visible_fraction(tables: dict[str, list[dict[str, Any]]]) -> None:
    assert [row["level"] for row in tables["visibility"]] == ["v0-40", "v40-60", "v60-80", "v80-100"]
    cars = [row for row in tables["sample_annotation"] if row["size"] == pytest.approx([2, 4, 1.5])]
    assert {row["visibility_token"] for row in cars} == {"4"}


def test_data_set_does_not_depend_on_the_number_of_workers(folder: Path, tmp_path: Path) -> None:
    poses, times = drive()
    write(street(), tmp_path, "nuscenes", cameras=poses, times=times, samples=1, key_every=2, workers=2)
    for path in (*(folder / "v1.0-mini").iterdir(), *(folder / "samples").rglob("*.bin")):
        assert path.read_bytes() == (tmp_path / path.relative_to(folder)).read_bytes()


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"key_every": 0}, "out_of_range"),
        ({"fps": -1}, "out_of_range"),
        ({"start_time": -1}, "out_of_range"),
        ({"version": "../x"}, "invalid_value"),
        ({"cameras": None}, "missing_value"),
    ],
)
def test_impossible_data_sets_are_refused(options: dict[str, Any], code: str, tmp_path: Path) -> None:
    with pytest.raises(raycam.SettingsError) as caught:
        write(street(), tmp_path, "nuscenes", **{"cameras": rig(), **options})
    assert caught.value.code == code
