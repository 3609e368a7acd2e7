"""Values beyond the range of a format, and images named after their source."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam
from raycam.dataset import FORMATS, write
from raycam.dataset.lost import depth_units, lost_notices
from support.blas_kernels import outputs_by_kernel
from support.box_table import picture
from support.raises import check_mentions, has_notice


def wall(depth: float) -> raycam.World:
    """A wall in the left half of the image at `depth` metres, and one in the right half at 3 m."""
    world = raycam.World()
    for x, z in ((-500.0, depth), (500.0, 3.0)):
        world.add_object(plane={"size": [1000, 2000]}, location=[x, 0, z], roll=180, category="wall")
    return world


def told(result: Any) -> list[str]:
    """The notices of a data set, except the one about missing lights."""
    return [notice for notice in result.notices if notice.code != "default_lights"]


def ahead(**options: Any) -> raycam.Camera:
    k = [[60.0, 0, 31.5], [0, 60.0, 23.5], [0, 0, 1]]
    return raycam.Camera(k, np.eye(3), np.zeros(3), (64, 48), **options)


@pytest.mark.parametrize(
    ("format", "limit", "unit", "folder"),
    [
        ("tum", 13.107, 0.2, "depth/0.000000.png"),
        ("scannet", 65.535, 1.0, "depth/0.png"),
        ("nerf", 65.535, 1.0, "depths/000000.png"),
        ("kitti", 255.996, 1000 / 256, "object/training/depth_2/000000.png"),
    ],
)
def test_depth_beyond_the_range_of_a_format_gives_a_notice(
    tmp_path: Path, format: str, limit: float, unit: float, folder: str
) -> None:
    inside = write(wall(limit * 0.999), tmp_path / "in", format, cameras=[ahead()])
    assert told(inside) == []
    assert picture(tmp_path / "in" / folder)[24, 5] == np.rint(limit * 0.999 * 1000 / unit)
    beyond = write(wall(limit * 1.001), tmp_path / "out", format, cameras=[ahead()])
    assert picture(tmp_path / "out" / folder)[24, 5] == 0
    (notice,) = told(beyond)
    assert notice.code == "values_lost"
    # Half of the image's pixels show the far wall.
    check_mentions(str(notice), [f"{limit:.6g}", 1536, 3072])
    if format != "kitti":
        wider = write(wall(limit * 1.001), tmp_path / "wide", format, cameras=[ahead()], depth_scale=2 * unit)
        assert told(wider) == []
        assert picture(tmp_path / "wide" / folder)[24, 5] == np.rint(limit * 1.001 * 1000 / unit / 2)


@pytest.mark.parametrize("shift", [0.0, 9.0, -4.5])
def test_kitti_p3_contains_the_principal_point_of_the_right_camera(tmp_path: Path, shift: float) -> None:
    left = ahead()
    right = left.replace(K=np.add(left.K, [[0, 0, shift], [0, 0, 0], [0, 0, 0]]), C=[0.2, 0, 0])
    write(wall(3.5), tmp_path, "kitti", cameras=raycam.Rig.of({"left": left, "right": right}))
    rows = (tmp_path / "object/training/calib/000000.txt").read_text().splitlines()
    calib = {
        row.split(":")[0]: np.array(row.split(":")[1].split(), float).reshape(3, -1) for row in rows if row
    }
    point = np.array([-0.4, 0.1, 3.5])
    pixels = [camera.project(point)[0][:, None] for camera in (left, right)]
    found = cv2.triangulatePoints(calib["P2"], calib["P3"], *pixels)[:, 0]
    np.testing.assert_allclose(found[:3] / found[3], point, atol=1e-9)


def test_disparities_outside_of_kittis_range_give_a_notice_with_their_count(tmp_path: Path) -> None:
    left = ahead()
    # u_left - u_right = 60 * 0.2 / z - shift: 4 - shift at 3 m, 1 - shift at 12 m.
    right = left.replace(K=np.add(left.K, [[0, 0, 2.0], [0, 0, 0], [0, 0, 0]]), C=[0.2, 0, 0])
    written = write(wall(12.0), tmp_path, "kitti", cameras=raycam.Rig.of({"left": left, "right": right}))
    (notice,) = told(written)
    assert notice.code == "values_lost"
    check_mentions(str(notice), [1536, 3072])  # half of the image's pixels are lost
    values = picture(tmp_path / "scene_flow/training/disp_occ_0/000000_10.png")
    assert values[24, 5] == 0
    assert values[24, 60] == 2 * 256


def test_images_keep_the_names_of_their_source_images(tmp_path: Path) -> None:
    cameras = {"a": ahead(), "b": ahead().replace(C=[0.1, 0, 0]), "c": ahead()}
    images = {"a": "IMG 1.JPG", "b": "left/IMG_2.jpg", "c": "../IMG_3.jpeg"}
    raycam.save_cameras(tmp_path / "t.json", cameras, "nerf", images=images)
    given = raycam.load_cameras(tmp_path / "t.json")
    expected = ["IMG 1.png", "left/IMG_2.png", "IMG_3.png"]
    write(wall(3.5), tmp_path / "coco", "coco", cameras=given)
    rows = json.loads((tmp_path / "coco/annotations/instances.json").read_text())["images"]
    assert [row["file_name"] for row in rows] == expected
    for row, camera in zip(rows, given.values(), strict=True):
        assert (tmp_path / "coco/images" / row["file_name"]).exists()
        again = raycam.Camera(row["K"], row["R"], row["C"], (64, 48), pixel_center=row["pixel_center"])
        assert again == camera
    assert [row["camera"] for row in rows] == list(given)
    write(wall(3.5), tmp_path / "nerf", "nerf", cameras=given)
    frames = json.loads((tmp_path / "nerf/transforms.json").read_text())["frames"]
    assert [frame["file_path"] for frame in frames] == [f"images/{name}" for name in expected]
    write(wall(3.5), tmp_path / "numbers", "coco", cameras=list(given.values()))
    rows = json.loads((tmp_path / "numbers/annotations/instances.json").read_text())["images"]
    assert [row["file_name"] for row in rows] == ["000000.png", "000001.png", "000002.png"]


NAMED = ("coco", "colmap", "nerf", "yolo", "panoptic", "photos", "semantic")
"""The formats whose images keep the names of the cameras' file (and "mcap", whose images are messages)."""


@pytest.mark.parametrize("format", sorted(set(FORMATS) - {"hdf5", "mcap", "semantickitti", "nuscenes"}))
def test_source_images_json_lists_the_image_of_each_view(tmp_path: Path, format: str) -> None:
    images = {"a": "IMG 1.JPG", "b": "left/IMG_2.jpg"}
    cameras = {"a": ahead(), "b": ahead().replace(C=[0.1, 0, 0])}
    raycam.save_cameras(tmp_path / "t.json", cameras, "nerf", images=images)
    given = raycam.load_cameras(tmp_path / "t.json")
    write(wall(3.5), tmp_path / "set", format, cameras=given, samples=1)
    rows = json.loads((tmp_path / "set/source_images.json").read_text())
    assert [row["image"] for row in rows] == list(images.values())
    assert [(row["view"], row["camera"]) for row in rows] == list(enumerate(given))
    named = [path for path in (tmp_path / "set").rglob("*") if path.stem in ("IMG 1", "IMG_1")]
    assert bool(named) == (format in NAMED)
    write(wall(3.5), tmp_path / "none", format, cameras=list(cameras.values()), samples=1)
    assert not (tmp_path / "none/source_images.json").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="OPENBLAS_CORETYPE selects the kernel on Linux only")
def test_matrix_products_do_not_depend_on_the_blas_kernel() -> None:
    script = """
import numpy as np
from raycam.arguments import lengths, product
rng = np.random.default_rng(1)
numbers = [product(rng.normal(size=(50, 3)), rng.normal(size=(3, 3))), lengths(rng.normal(size=(50, 3)))]
from raycam.randomize import views
axes = [views._axes(a, b) for a, b in rng.normal(size=(200, 2, 3))]
numbers += axes
import raycam
left = [raycam.Camera.look_at(e, [0, 0, 0], size=(64, 48)) for e in rng.normal(size=(20, 3))]
for one in left:
    rig = raycam.Rig.of({"l": one, "r": one.replace(C=one.C + 0.1 * one.R[0] + 0.001 * one.R[1])})
    numbers += [rig.rectified()["left"].R, rig["r"].R, rig["r"].C]
from raycam.annotations.labels import Box3D
numbers += [Box3D(a, rng.normal(size=3), rng.normal(size=3)).corners for a in axes]
import hashlib
print(hashlib.sha256(b"".join(np.ascontiguousarray(n).tobytes() for n in numbers)).hexdigest())
"""
    outputs = outputs_by_kernel(script)
    assert len(outputs) >= 2
    assert len(set(outputs)) == 1


@pytest.mark.parametrize(("start", "unit"), [(1.7e9, " seconds"), (1.7e18, "nanoseconds"), (20.0, "20.0")])
def test_times_after_the_end_of_the_motion_give_a_notice(tmp_path: Path, start: float, unit: str) -> None:
    world = wall(3.5)
    world.set_video(fps=4, seconds=1, orbit={"target": [0, 0, 3], "degrees": 40})
    late = write(world, tmp_path / "late", "coco", cameras=[ahead()] * 2, times=[start, start + 1024])
    assert has_notice(told(late), "outside_times", unit)
    assert not told(write(world, tmp_path / "early", "coco", cameras=[ahead()] * 2, times=[0.0, 0.5]))


@pytest.mark.parametrize(("times", "many"), [([0.0, 250.0, 500.0], "2 of 3"), ([-9.0, -8.5, 0.5], "2 of 3")])
def test_some_times_outside_of_the_video_give_a_notice_with_their_count(
    tmp_path: Path, times: list[float], many: str
) -> None:
    # milliseconds instead of seconds, and an offset added twice
    world = wall(3.5)
    world.set_video(fps=4, seconds=1, orbit={"target": [0, 0, 3], "degrees": 40})
    (notice,) = told(write(world, tmp_path, "coco", cameras=[ahead()] * 3, times=times))
    assert notice.code == "outside_times"
    check_mentions(str(notice), [many])


def test_image_names_that_differ_only_in_case_or_ending_stay_distinct(tmp_path: Path) -> None:
    cameras = {name: ahead() for name in "abcd"}
    images = {"a": "IMG.png", "b": "img.png", "c": "img.jpg", "d": "left/img.png"}
    raycam.save_cameras(tmp_path / "t.json", cameras, "nerf", images=images)
    write(wall(3.5), tmp_path / "coco", "coco", cameras=raycam.load_cameras(tmp_path / "t.json"))
    rows = json.loads((tmp_path / "coco/annotations/instances.json").read_text())["images"]
    names = [row["file_name"] for row in rows]
    assert names[0] == "IMG.png"
    assert names[3] == "left/img.png"
    # The names also differ on file systems that ignore case.
    assert len({name.casefold() for name in names}) == 4
    assert all((tmp_path / "coco/images" / name).exists() for name in names)


def test_kitti_flow_beyond_its_range_is_reported(tmp_path: Path) -> None:
    """The near wall moves by f B / Z = 60 * 30 / 3 = 600 pixels, the far wall by 60 pixels.

    The near wall fills the left half of the image.
    """
    world = raycam.World()
    for x, z in ((-500.0, 3.0), (500.0, 30.0)):
        world.add_object(plane={"size": [1000, 2000]}, location=[x, 0, z], roll=180, category="wall")
    cameras = [ahead(), ahead().at_pose(np.eye(3), [-30.0, 0, 0])]
    result = write(world, tmp_path, "kitti", cameras=cameras, flow=True, samples=1, integrator="flat")
    (notice,) = told(result)
    encoded = cv2.imread(str(tmp_path / "scene_flow/training/flow_occ/000000_10.png"), cv2.IMREAD_UNCHANGED)
    valid = encoded[..., 0] == 1
    assert notice.code == "values_lost"
    check_mentions(str(notice), [np.count_nonzero(~valid), valid.size])
    assert not valid[:, :31].any()
    assert valid[:, 33:].all()
    np.testing.assert_allclose((encoded[:, 33:, 2] - 32768.0) / 64, 60.0, atol=1 / 64)


def test_depth_behind_the_camera_is_reported_without_a_depth_scale() -> None:
    depth = np.array([[-1.0, 0.0004, 1.0, 70.0, np.inf]], np.float32)
    values, unit, record = depth_units(depth, 1.0)
    assert values.tolist() == [[0, 0, 1000, 0, 0]]
    assert unit == 1.0
    behind, beyond = lost_notices([record], "photos")
    check_mentions(str(behind), ["2 of 4", "behind the camera"])
    check_mentions(str(beyond), ["1 of 4", "65.535 m", "depth_scale"])
    assert "depth_scale" not in str(behind)
