"""Cameras of benchmarks, NumPy files and folders, and recognised unsupported files."""

from __future__ import annotations

import gzip
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam
from raycam.errors import FormatError
from scipy.spatial.transform import Rotation
from support.camera_truth import brown, check, four, intrinsics, picture, pose, rows
from support.raises import Fault, fault, has_notice, raises

K = intrinsics(520.5, 518.25, 321.0, 242.5)
SIZE = (640, 480)
D = np.array([[-0.1, 0.02, 0.001, -0.002, 0.003]])


def lens(x: Any) -> Any:
    return brown(x, (-0.1, 0.02, 0.003), (0.001, -0.002))


def test_middlebury_calibrations_are_read(tmp_path: Path) -> None:
    file = tmp_path / "calib.txt"
    file.write_text(
        "cam0=[520.5 0 321; 0 520.5 242.5; 0 0 1]\ncam1=[520.5 0 352.25; 0 520.5 242.5; 0 0 1]\ndoffs=31.25\n"
        "baseline=193.001\nwidth=640\nheight=480\nndisp=290\nisint=0\nvmin=31\nvmax=257\n"
    )
    cameras = raycam.load_cameras(tmp_path)
    check(cameras["cam1"], intrinsics(520.5, 520.5, 352.25, 242.5), np.eye(3), np.array([0.193001, 0, 0]))
    assert list(cameras.rigs["rig"]) == ["cam0", "cam1"]
    assert has_notice(cameras.notices, "assumed_convention", "193.001 mm", "cam0")
    file.write_text(file.read_text().replace("cam1=[520.5", "cam1=[521.5"))
    with raises(FormatError, code="syntax", mentions=["calib.txt:2"]):
        raycam.load_cameras(file)


@pytest.mark.parametrize("opened", ["", "cams"])
def test_mvsnet_cameras_are_read(tmp_path: Path, opened: str) -> None:
    (tmp_path / "cams").mkdir()
    for i in range(2):
        R, C = pose(i)
        body = f"extrinsic\n{rows(four(R, -R @ C))}\nintrinsic\n{rows(K)}\n425.0 2.5\n"
        (tmp_path / f"cams/{i:08d}_cam.txt").write_text(body)
        picture(tmp_path / f"images/{i:08d}.jpg", (1280, 960))
    cameras = raycam.load_cameras(tmp_path / opened)
    for i, camera in enumerate(cameras.values()):
        check(camera, K, *pose(i))
    assert has_notice(cameras.notices, "implausible", '"00000000"', "K")


def test_neus_cameras_are_read(tmp_path: Path) -> None:
    arrays: dict[str, Any] = {}
    own = intrinsics(520.5, 518.25, 321.0, 242.5, 0.3)
    for i in range(12):
        R, C = pose(i)
        arrays[f"world_mat_{i}"] = np.vstack(
            [(-2.5 if i % 2 else 1) * own @ np.column_stack([R, -R @ C]), [0, 0, 0, 1]]
        )
        arrays[f"scale_mat_{i}"] = np.diag([3.0, 3, 3, 1])
    np.savez(tmp_path / "cameras_sphere.npz", **arrays)
    picture(tmp_path / "image/000.png")
    cameras = raycam.load_cameras(tmp_path, size=SIZE)
    assert list(cameras) == [str(i) for i in range(12)]
    for i, camera in enumerate(cameras.values()):
        check(camera, own, *pose(i))
    assert has_notice(cameras.notices[:1], "placed_cameras", "scale_mat")


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", ["<f8", ">f8"])
def test_llff_poses_are_read(tmp_path: Path, order: Any, dtype: str) -> None:
    found = []
    for i in range(3):
        R, C = pose(i)
        right, down, forward = R
        matrix = np.column_stack([down, right, -forward, C, [480, 640, 520.0]])
        found.append([*matrix.ravel(), 0.5, 10.0])
    np.save(tmp_path / "poses_bounds.npy", np.array(found, dtype=dtype, order=order))
    for i, camera in enumerate(raycam.load_cameras(tmp_path).values()):
        check(camera, intrinsics(520, 520, 320, 240), *pose(i))


def cam_model(kind: str, params: list[float], **keys: Any) -> dict[str, Any]:
    return {
        "image_width": 640,
        "image_height": 480,
        "projection_model_type": kind,
        "projection_params": params,
        **keys,
    }


def test_head_mounted_cameras_of_bop_are_read(tmp_path: Path) -> None:
    R, C = pose(1)
    k, p, s = [0.02, -0.01, 0.003, 0.0, 0.001, 0.0], [0.001, -0.002], [0.0005, 0.0, -0.0003, 0.0001]
    place = {"cam_R_w2c": R.ravel().tolist(), "cam_t_w2c": (-1000 * R @ C).tolist()}
    table = {
        "3": {
            "cam_model": cam_model("CameraModelType.FISHEYE624", [300.0, 320.0, 240.0, *k, *p, *s]),
            **place,
        },
        "4": {"cam_model": cam_model("PinholePlane", [520.5, 518.25, 321.0, 242.5]), **place},
    }
    file = tmp_path / "scene_camera.json"
    file.write_text(json.dumps(table))
    cameras = raycam.load_cameras(file)
    check(cameras["4"], K, R, C)
    np.testing.assert_array_equal(cameras["3"].distortion, [*k, *p, *s])
    table["4"]["cam_K"] = K.ravel().tolist()
    file.write_text(json.dumps(table))
    with raises(FormatError, code="syntax", mentions=["cam_K"]):
        raycam.load_cameras(file)


def test_hot3d_cameras_are_read(tmp_path: Path) -> None:
    R, C = pose(2)
    quaternion = np.roll(Rotation.from_matrix(R.T).as_quat(), 1).tolist()
    world = {"quaternion_wxyz": quaternion, "translation_xyz": C.tolist()}
    model = cam_model("OpenCV", [520.5, 518.25, 321.0, 242.5, -0.1, 0.02, 0.003, 0.001, -0.002])
    file = tmp_path / "000000.cameras.json"
    file.write_text(json.dumps({"214-1": {"calibration": model, "T_world_from_camera": world}}))
    check(raycam.load_cameras(file)["214-1"], K, R, C, lens)
    model["projection_model_type"] = "Spherical9"
    file.write_text(json.dumps({"214-1": {"calibration": model, "T_world_from_camera": world}}))
    with raises(FormatError, code="unsupported_feature", mentions=["Spherical9"]):
        raycam.load_cameras(file)


# OpenCV's calibrations in arrays and compressed -------------------------------------------------------------


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
@pytest.mark.parametrize("dtype", [np.float64, np.float32, ">f8"])
def test_npz_calibrations_are_read(tmp_path: Path, save: Any, dtype: Any) -> None:
    own, d = np.asfortranarray(np.round(K).astype(dtype)), D.T.astype(dtype)
    save(tmp_path / "a.npz", mtx=own, dist=d, ret=0.3, img_size=np.array(SIZE), map1=np.zeros((480, 640, 2)))
    camera = raycam.load_cameras(tmp_path / "a.npz")["a"]
    terms = d.ravel().astype(float)
    check(
        camera,
        own.astype(float),
        np.eye(3),
        np.zeros(3),
        lambda x: brown(x, (*terms[:2], terms[4]), (*terms[2:4],)),
    )
    assert camera.size == SIZE


def test_stereo_pair_and_board_views_in_npz_are_read(tmp_path: Path) -> None:
    R, C = pose(3)
    T = (-R @ C)[:, None]
    np.savez(tmp_path / "s.npz", K1=K, D1=D, K2=K, D2=D, R=R, T=T, R1=R, P1=np.eye(3, 4), imageSize=SIZE)
    check(raycam.load_cameras(tmp_path / "s.npz")["camera2"], K, R, C, lens)
    vectors = [Rotation.from_matrix(pose(i)[0]).as_rotvec() for i in range(3)]
    shifts = [-pose(i)[0] @ pose(i)[1] for i in range(3)]
    np.savez(
        tmp_path / "v.npz",
        mtx=K,
        dist=D,
        rvecs=np.array(vectors)[..., None],
        tvecs=np.array(shifts)[..., None],
    )
    cameras = raycam.load_cameras(tmp_path / "v.npz", size=SIZE)
    for i, camera in enumerate(cameras.values()):
        check(camera, K, *pose(i), lens)


@pytest.mark.parametrize("name", ["camera_matrix.npy", "dist_coeffs.npy"])
def test_arrays_in_separate_npy_files_are_combined(tmp_path: Path, name: str) -> None:
    np.save(tmp_path / "camera_matrix.npy", K)
    np.save(tmp_path / "dist_coeffs.npy", D)
    (camera,) = raycam.load_cameras(tmp_path / name, size=SIZE).values()
    check(camera, K, np.eye(3), np.zeros(3), lens)


def test_pickles_are_refused(tmp_path: Path) -> None:
    import pickle

    (tmp_path / "a.p").write_bytes(pickle.dumps({"mtx": K, "dist": D}))
    with raises(FormatError, code="unsupported_feature", mentions=["a.p"]):
        raycam.load_cameras(tmp_path / "a.p", size=SIZE)
    np.savez(tmp_path / "b.npz", mtx=K, dist=np.array({"k1": 0.1}, dtype=object))
    with raises(FormatError, code="wrong_type", mentions=["b.npz:1", "dist"]):
        raycam.load_cameras(tmp_path / "b.npz", size=SIZE)
    np.savez(tmp_path / "c.npz", mtx=K, lens_model=np.array({"k1": 0.1}, dtype=object))
    with raises(FormatError, code="syntax", mentions=["c.npz:1", '"plumb_bob"']):
        raycam.load_cameras(tmp_path / "c.npz", size=SIZE)


@pytest.mark.parametrize("ending", ["yml", "xml", "json"])
def test_gzipped_opencv_storage_is_read(tmp_path: Path, ending: str) -> None:
    file = cv2.FileStorage(str(tmp_path / f"a.{ending}"), cv2.FILE_STORAGE_WRITE)
    file.write("camera_matrix", K)
    file.write("dist_coeff", D)
    file.release()
    packed = tmp_path / f"a.{ending}.gz"
    packed.write_bytes(gzip.compress((tmp_path / f"a.{ending}").read_bytes()))
    (camera,) = raycam.load_cameras(packed, size=SIZE).values()
    check(camera, K, np.eye(3), np.zeros(3), lens)
    packed.write_bytes(packed.read_bytes()[:-30])
    with raises(FormatError, code="syntax", mentions=[packed.name]):
        raycam.load_cameras(packed, size=SIZE)


# Folders, mistakes, unsupported files ----------------------------------------------------------------------


def test_ros_stereo_pair_in_two_files_is_read_as_a_rig(tmp_path: Path) -> None:
    turns = [
        Rotation.from_euler("xyz", angles, degrees=True).as_matrix() for angles in ([1, 2, -1], [-1, 1, 0.5])
    ]
    for side, turn, shift in zip(("left", "right"), turns, (0.0, -60.0), strict=True):
        matrix = {"rows": 3, "cols": 3, "data": K.ravel().tolist()}
        table = {
            "image_width": 640,
            "image_height": 480,
            "camera_name": f"narrow_{side}",
            "camera_matrix": matrix,
        }
        table |= {
            "distortion_model": "plumb_bob",
            "distortion_coefficients": {"rows": 1, "cols": 5, "data": D[0].tolist()},
        }
        table["rectification_matrix"] = {"rows": 3, "cols": 3, "data": turn.ravel().tolist()}
        P = [500.0, 0, 320, shift, 0, 500.0, 240, 0, 0, 0, 1, 0]
        table["projection_matrix"] = {"rows": 3, "cols": 4, "data": P}
        import yaml

        (tmp_path / f"{side}.yaml").write_text(yaml.safe_dump(table))
    cameras = raycam.load_cameras(tmp_path)
    check(cameras["left"], K, turns[0].T, np.zeros(3), lens)
    check(cameras["right"], K, turns[1].T, np.array([0.12, 0, 0]), lens)
    assert list(cameras.rigs["rig"]) == ["left", "right"]


def test_folder_with_several_calibrations_raises_with_their_names(tmp_path: Path) -> None:
    np.save(tmp_path / "poses_bounds.npy", np.zeros((2, 17)))
    (tmp_path / "traj.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n")
    with raises(
        FormatError, code="unsupported_feature", mentions=["poses_bounds.npy", "llff", "traj.txt", "poses"]
    ):
        raycam.load_cameras(tmp_path)
    eye = raycam.Camera(K, np.eye(3), np.zeros(3), SIZE)
    assert len(raycam.load_cameras(tmp_path, "poses", intrinsics=eye)) == 1


@pytest.mark.parametrize(
    ("K", "value"),
    [
        (intrinsics(500, 500, -40.0, 240), "-40"),
        (intrinsics(500, 500, 320, 700), "700"),
        (intrinsics(1000, 1000, 640, 480), "1280 x 960"),
        (intrinsics(250, 250, 160, 120), "320 x 240"),
    ],
)
def test_likely_mistakes_in_a_calibration_give_a_notice(tmp_path: Path, K: Any, value: str) -> None:
    file = tmp_path / "a.json"
    file.write_text(json.dumps({"K": K.tolist(), "dist": [0, 0, 0, 0, 0], "image_size": SIZE}))
    assert has_notice(raycam.load_cameras(file).notices, "implausible", value)


def test_lens_without_rays_for_most_pixels_gives_a_notice(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_text(json.dumps({"K": K.tolist(), "dist": [-5.0, 0, 0, 0, 0], "image_size": SIZE}))
    assert has_notice(raycam.load_cameras(file).notices, "implausible", "92 %")


def test_intrinsics_relative_to_the_image_size_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_text("0.8 1.1 0.5 0.5\n")
    with raises(FormatError, code="syntax", mentions=["a.txt", '"a"']):
        raycam.load_cameras(file, size=SIZE)


@pytest.mark.parametrize(
    ("data", "name"),
    [
        (b"MATLAB 5.0 MAT-file, Platform: GLNXA64", fault("unsupported_feature", "MATLAB")),
        (b"\x89HDF\r\n\x1a\n", fault("unsupported_feature", "HDF5")),
        (
            b'{"CalibrationInformation": {"Cameras": [{"Intrinsics": {"ModelParameters": [1]}}]}}',
            fault("unsupported_feature", "Azure"),
        ),
        (
            b"#polynomial coefficients for the DIRECT mapping\n5 -200 0 1e-3 2e-6 3e-9\n\n#polynomial\n",
            fault("unsupported_feature", "OCamCalib"),
        ),
        (
            b'{"priors": [{"CameraIntrinsicsPrior": {"image_name": "a.jpg", "focal_length": 300}}]}',
            fault("unsupported_feature", "Theia"),
        ),
        (
            b"#MVE view meta data\n[camera]\nfocal_length = 0.8\n\n[view]\nid = 0\nname = 0000\n",
            fault("unsupported_feature", "MVE"),
        ),
    ],
)
def test_unsupported_formats_are_refused_with_their_name(tmp_path: Path, data: bytes, name: Fault) -> None:
    file = tmp_path / "a.bin"
    file.write_bytes(data)
    with raises(FormatError, **name):
        raycam.load_cameras(file)


def test_damaged_npz_files_raise(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "a.npz", mtx=K, dist=D)
    data = (tmp_path / "a.npz").read_bytes()
    file = tmp_path / "b.npz"
    for end in range(4, len(data), 7):
        file.write_bytes(data[:end])
        with pytest.raises(FormatError):
            raycam.load_cameras(file, size=SIZE)


@pytest.mark.parametrize("third", ["extrinsics.yml", "stereo.yml", None])
def test_stereo_pair_in_two_files_uses_extrinsics_of_a_third_file(tmp_path: Path, third: str | None) -> None:
    R, C = pose(3)
    for side in ("left", "right"):
        file = cv2.FileStorage(str(tmp_path / f"{side}.yml"), cv2.FILE_STORAGE_WRITE)
        file.write("camera_matrix", K)
        file.write("dist_coeffs", D)
        file.release()
    if third is not None:
        file = cv2.FileStorage(str(tmp_path / third), cv2.FILE_STORAGE_WRITE)
        file.write("R", R)
        file.write("T", -R @ C)
        file.release()
    cameras = raycam.load_cameras(tmp_path, size=SIZE)
    assert list(cameras) == ["left", "right"]
    if third is None:
        assert has_notice(cameras.notices, "missing_value", "R and T")
    else:
        check(cameras["right"], K, R, C, lens)


def separate_intrinsics(camera: Any, scale: float = 1.0) -> dict[str, Any]:
    """Arrays of a file with K in `camera_mat_0`, and `scale` times [R t] in `world_mat_0`."""
    R, C = pose(0)
    return {
        "camera_mat_0": camera,
        "world_mat_0": np.vstack([scale * np.column_stack([R, -R @ C]), [0, 0, 0, 1]]),
    }


@pytest.mark.parametrize("scale", [1.0, 2.5, 0.01])
def test_scaled_pose_next_to_camera_mat_is_read(tmp_path: Path, scale: float) -> None:
    camera = np.array([[2.0, 0, 0.1, 0], [0, 3.0, -0.05, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    np.savez(tmp_path / "cameras.npz", **separate_intrinsics(camera, scale))
    found = raycam.load_cameras(tmp_path / "cameras.npz", size=SIZE)["0"]
    # camera_mat is in units of half the image size; the first pixel's centre is (0.5, 0.5).
    assert found.pixel_center == "half"
    np.testing.assert_allclose(found.K, [[640, 0, 352], [0, 720, 228], [0, 0, 1]])
    np.testing.assert_allclose(found.R, pose(0)[0], atol=1e-12)
    np.testing.assert_allclose(found.C, pose(0)[1], atol=1e-12)


def test_camera_mat_in_pixels_is_read_with_a_notice(tmp_path: Path) -> None:
    np.savez(tmp_path / "cameras.npz", **separate_intrinsics(K))
    cameras = raycam.load_cameras(tmp_path / "cameras.npz", size=SIZE)
    check(cameras["0"], K, *pose(0))
    assert has_notice(cameras.notices, "assumed_convention", "camera_mat_0")


def test_missing_camera_mat_is_named_in_the_error(tmp_path: Path) -> None:
    arrays = separate_intrinsics(np.diag([2.0, 2.0, 1.0]))
    np.savez(tmp_path / "cameras.npz", **arrays, world_mat_1=arrays["world_mat_0"])
    with raises(FormatError, code="syntax", mentions=["world_mat_1", "camera_mat_1"]):
        raycam.load_cameras(tmp_path / "cameras.npz", size=SIZE)


@pytest.mark.parametrize("kind", ["json", "npy", "txt"])
def test_camera_matrix_with_a_short_focal_length_gives_a_notice(tmp_path: Path, kind: str) -> None:
    R, C = pose(0)
    P = intrinsics(3.5, 3.5, 320, 240) @ np.column_stack([R, -R @ C])
    path = tmp_path / f"camera.{kind}"
    if kind == "json":
        path.write_text(json.dumps({"P": P.tolist(), "width": 640, "height": 480}))
    elif kind == "npy":
        np.save(path, P)
    else:
        np.savetxt(path, P)
    cameras = raycam.load_cameras(path, size=SIZE)
    np.testing.assert_allclose(cameras["camera"].K, intrinsics(3.5, 3.5, 320, 240), atol=1e-6)
    assert has_notice(cameras.notices, "implausible", "3.5")


def test_notices_of_several_files_are_grouped(tmp_path: Path) -> None:
    matrix = rows(np.column_stack([np.eye(3), [0.1, 0.2, 0.3]]))
    for i in range(5):
        (tmp_path / f"cam{i}.yaml").write_text(
            "cameras:\n- camera:\n    image_height: 480\n    image_width: 640\n    type: pinhole\n"
            "    intrinsics: {rows: 4, cols: 1, data: [500, 500, 320, 240]}\n"
            f"  T_B_C: {{rows: 4, cols: 4, data: [{matrix}, 0, 0, 0, 1]}}\n"
        )
    placed = [notice for notice in raycam.load_cameras(tmp_path).notices if notice.code == "placed_cameras"]
    assert len(placed) == 1
    for fact in ("cam0", "cam2", "2 more"):
        assert fact in str(placed[0])
