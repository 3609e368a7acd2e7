"""The NeRF family (splits, apps, Gaussian splats, camera paths), compared with closed forms."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.errors import FormatError
from scipy.spatial.transform import Rotation
from support.camera_truth import OPENGL, check, four, intrinsics, picture, pose
from support.raises import has_notice, raises

SIZE = (640, 480)


def opengl(seed: int) -> Any:
    R, C = pose(seed)
    return four(R.T @ OPENGL, C)


def test_all_splits_of_a_blender_data_set_are_read(tmp_path: Path) -> None:
    for split, count in {"train": 3, "val": 1, "test": 2}.items():
        frames = [
            {"file_path": f"./{split}/r_{i}", "rotation": 0.01, "transform_matrix": opengl(i).tolist()}
            for i in range(count)
        ]
        for i in range(count):
            picture(tmp_path / split / f"r_{i}.png")
        text = json.dumps({"camera_angle_x": 0.7, "frames": frames})
        (tmp_path / f"transforms_{split}.json").write_text(text)
    cameras = raycam.load_cameras(tmp_path)
    assert [*cameras] == ["train/r_0", "train/r_1", "train/r_2", "val/r_0", "test/r_0", "test/r_1"]
    focal = 320 / np.tan(0.35)
    for name, camera in cameras.items():
        check(camera, intrinsics(focal, focal, 320, 240), *pose(int(name[-1])))
        assert camera.size == SIZE
        assert camera.pixel_center == "half"
    assert len(raycam.load_cameras(tmp_path / "transforms_val.json")) == 1


def test_cameras_of_missing_images_use_the_size_of_other_images_with_a_notice(tmp_path: Path) -> None:
    for split in ("train", "val"):
        frames = [{"file_path": f"./{split}/r_{i}", "transform_matrix": opengl(i).tolist()} for i in range(2)]
        text = json.dumps({"camera_angle_x": 0.7, "frames": frames})
        (tmp_path / f"transforms_{split}.json").write_text(text)
    with raises(FormatError, code="missing_argument", mentions=["transforms_train.json:1"]):
        raycam.load_cameras(tmp_path)
    picture(tmp_path / "train/r_1.png")
    cameras = raycam.load_cameras(tmp_path)
    assert has_notice(cameras.notices, "assumed_convention", "transforms_train.json", 1, "size=")
    assert has_notice(cameras.notices, "assumed_convention", "transforms_val.json", 2, "size=")
    for i, camera in enumerate(cameras.values()):
        check(camera, intrinsics(320 / np.tan(0.35), 320 / np.tan(0.35), 320, 240), *pose(i % 2))


def test_lens_of_a_frame_overrides_the_lens_of_the_file(tmp_path: Path) -> None:
    own = {"distortion_params": [0.01, -0.02, 0.003, 0, 0.001, -0.002]}
    frame = {"file_path": "a.png", "transform_matrix": opengl(1).tolist()}
    table = {"fl_x": 500, "cx": 320, "cy": 240, "w": 640, "h": 480, "k1": 0.5, "frames": [{**frame, **own}]}
    (tmp_path / "t.json").write_text(json.dumps(table))
    (camera,) = raycam.load_cameras(tmp_path / "t.json").values()
    np.testing.assert_allclose(camera.distortion, [0.01, -0.02, 0.001, -0.002, 0.003])
    table["frames"] = [{**frame, **own, "k1": 0.5}]
    (tmp_path / "t.json").write_text(json.dumps(table))
    with raises(FormatError, code="syntax", mentions=["t.json:1", "frames[0].distortion_params"]):
        raycam.load_cameras(tmp_path / "t.json")


def nerf(path: Path, **keys: Any) -> Path:
    path.write_text(
        json.dumps({**keys, "frames": [{"file_path": "a.png", "transform_matrix": opengl(1).tolist()}]})
    )
    return path


def test_instant_ngp_angles_are_read_as_degrees(tmp_path: Path) -> None:
    file = nerf(
        tmp_path / "t.json", w=640, h=480, x_fov=50.0, camera_angle_x=0.1, scale=0.3, offset=[0, 0, 1]
    )
    cameras = raycam.load_cameras(file)
    focal = 320 / np.tan(np.radians(25.0))
    check(cameras["a.png"], intrinsics(focal, focal, 320, 240), *pose(1))
    assert has_notice(cameras.notices, "placed_cameras", "scale", "offset")


def test_fisheye624_of_nerfstudio_is_read(tmp_path: Path) -> None:
    k, p, s = [0.02, -0.01, 0.003, 0.0, 0.001, 0.0], [0.001, -0.002], [0.0005, 0.0, -0.0003, 0.0001]
    shared = {
        "w": 640,
        "h": 480,
        "fl_x": 300,
        "fl_y": 300,
        "cx": 320,
        "cy": 240,
        "camera_model": "FISHEYE624",
    }
    short = raycam.load_cameras(nerf(tmp_path / "a.json", **shared, distortion_params=[*k, *p, *s]))["a.png"]
    long = raycam.load_cameras(
        nerf(tmp_path / "b.json", **shared, distortion_params=[300, 300, 320, 240, *k, *p, *s])
    )["a.png"]
    assert short.model == "rad_tan_thin_prism_fisheye"
    np.testing.assert_array_equal(short.distortion, [*k, *p, *s])
    np.testing.assert_array_equal(short.K, long.K)


@pytest.mark.parametrize(("fl_x", "told"), [(400.0, False), (123.0, True)])
def test_panoramas_with_inconsistent_intrinsics_give_a_notice(
    tmp_path: Path, fl_x: float, told: bool
) -> None:
    keys: dict[str, Any] = {"w": 800, "h": 400, "fl_x": fl_x, "fl_y": 400, "cx": 400, "cy": 200}
    cameras = raycam.load_cameras(nerf(tmp_path / "a.json", camera_model="EQUIRECTANGULAR", **keys))
    assert has_notice(cameras.notices, "ignored_key", "EQUIRECTANGULAR", "fl_x") == told
    np.testing.assert_allclose(cameras["a.png"].K[0, 0], 800 / (2 * np.pi))


@pytest.mark.parametrize("model", ["ORTHOPHOTO", "VR180_L", "OMNIDIRECTIONALSTEREO_R"])
def test_unsupported_camera_models_are_refused(tmp_path: Path, model: str) -> None:
    keys: dict[str, Any] = {"w": 800, "h": 400, "fl_x": 400, "fl_y": 400, "cx": 400, "cy": 200}
    with raises(FormatError, code="unsupported_feature", mentions=[model]):
        raycam.load_cameras(nerf(tmp_path / "a.json", camera_model=model, **keys))


def polycam(seed: int, **keys: Any) -> str:
    matrix = opengl(seed)
    rows = {f"t_{i}{j}": float(matrix[i, j]) for i in range(3) for j in range(4)}
    shared = {
        "fx": 700.0,
        "fy": 701.0,
        "cx": 325.0,
        "cy": 244.0,
        "width": 640,
        "height": 480,
        "blur_score": 3.0,
    }
    return json.dumps({**shared, **rows, **keys})


@pytest.mark.parametrize("opened", ["", "keyframes", "keyframes/corrected_cameras"])
def test_polycam_cameras_are_read(tmp_path: Path, opened: str) -> None:
    for folder, first in (("cameras", 10), ("corrected_cameras", 0)):
        (tmp_path / "keyframes" / folder).mkdir(parents=True)
        for i in range(2):
            (tmp_path / "keyframes" / folder / f"{9 + i}.json").write_text(polycam(first + i))
    cameras = raycam.load_cameras(tmp_path / opened)
    assert list(cameras) == ["9", "10"]
    for i, camera in enumerate(cameras.values()):
        check(camera, intrinsics(700, 701, 325, 244), *pose(i))
    file = tmp_path / "a.json"
    file.write_text(polycam(0, k1=0.1))
    with raises(FormatError, code="syntax", mentions=["k1"]):
        raycam.load_cameras(file)


@pytest.mark.parametrize("kind", ["columns", "rows", "r3d", "frames"])
def test_record3d_poses_are_read(tmp_path: Path, kind: str) -> None:
    K = intrinsics(1400.0, 1401.0, 325.5, 244.5)
    poses = []
    for i in range(3):
        matrix = opengl(i)
        poses.append([*Rotation.from_matrix(matrix[:3, :3]).as_quat(), *matrix[:3, 3]])
    table: dict[str, Any] = {"w": 640, "h": 480, "dw": 192, "dh": 256, "fps": 60, "poses": poses}
    table["K"] = (K if kind == "rows" else K.T).ravel().tolist()
    if kind == "frames":
        table["perFrameIntrinsicCoeffs"] = [[1000.0 + i, 1001.0, 320.0, 240.0] for i in range(3)]
        table["frameTimestamps"] = [0.5, 0.6, 0.7]
    file = tmp_path / "metadata.json"
    file.write_text(json.dumps(table))
    if kind == "r3d":
        with zipfile.ZipFile(tmp_path / "a.r3d", "w", zipfile.ZIP_DEFLATED) as packed:
            packed.write(file, "metadata")
        file = tmp_path / "a.r3d"
    cameras = raycam.load_cameras(file)
    for i, camera in enumerate(cameras.values()):
        own = intrinsics(1000.0 + i, 1001.0, 320.0, 240.0) if kind == "frames" else K
        check(camera, own, *pose(i))
    assert cameras.times == ({"0": 0.5, "1": 0.6, "2": 0.7} if kind == "frames" else {})


def test_cameras_of_gaussian_splats_are_read(tmp_path: Path) -> None:
    listed = [
        {
            "id": i,
            "img_name": f"DSC_{i}",
            "width": 640,
            "height": 480,
            "position": pose(i)[1].tolist(),
            "rotation": pose(i)[0].T.tolist(),
            "fy": 601.0,
            "fx": 600.0,
        }
        for i in range(3)
    ]
    (tmp_path / "cameras.json").write_text(json.dumps(listed))
    cameras = raycam.load_cameras(tmp_path)
    for i, camera in enumerate(cameras.values()):
        check(camera, intrinsics(600, 601, 320, 240), *pose(i))
    assert has_notice(cameras.notices, "missing_value", "principal point")


@pytest.mark.parametrize("kind", ["perspective", "fisheye", "equirectangular", "vr180"])
def test_nerfstudio_camera_paths_are_read(tmp_path: Path, kind: str) -> None:
    size = (800, 400)
    path = [
        {"camera_to_world": opengl(i).ravel().tolist(), "fov": 50.0, "aspect": 2.0, "render_time": 0}
        for i in range(2)
    ]
    table = {
        "camera_type": kind,
        "render_width": size[0],
        "render_height": size[1],
        "fps": 24,
        "camera_path": path,
    }
    file = tmp_path / "camera_path.json"
    file.write_text(json.dumps(table))
    if kind == "vr180":
        with raises(FormatError, code="syntax", mentions=["vr180"]):
            raycam.load_cameras(file)
        return
    cameras = raycam.load_cameras(file)
    assert list(cameras.times.values()) == [0.0, 1 / 24]
    assert has_notice(cameras.notices, "placed_cameras", "dataparser_transforms.json")
    focal = 200 / np.tan(np.radians(25.0))
    R, C = pose(1)
    camera = cameras["000001"]
    if kind == "perspective":
        check(camera, intrinsics(focal, focal, 400, 200), R, C)
    elif kind == "fisheye":
        from support.camera_truth import equidistant

        check(camera, intrinsics(focal, focal, 400, 200), R, C, equidistant)
    else:
        np.testing.assert_allclose(camera.project((C + R[2])[None])[0], [[400, 200]], atol=1e-9)
