"""OpenCV calibrations with keys chosen by users, compared with OpenCV's projection."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
import raycam
import yaml
from raycam.errors import CameraError, FormatError
from support.raises import Fault, fault, has_notice, raises

K = np.array([[812.25, 0.0, 331.5], [0.0, 790.5, 229.125], [0.0, 0.0, 1.0]])
BROWN = [-0.21, 0.083, 0.0011, -0.0007, 0.013]
FISHEYE = [0.04, -0.013, 0.007, -0.002]
SIZE = (640, 480)
POINTS = np.random.default_rng(3).uniform([-0.6, -0.4, 1.5], [0.6, 0.4, 3.0], (40, 3))


def projected(distortion: npt.ArrayLike, fisheye: bool = False) -> npt.NDArray[Any]:
    """The pixels of POINTS for a camera at the origin, by OpenCV."""
    zero = np.zeros(3)
    d = np.asarray(distortion, dtype=float)
    if fisheye:
        return cv2.fisheye.projectPoints(POINTS[:, None], zero, zero, K, d)[0][:, 0]
    return cv2.projectPoints(POINTS, zero, zero, K, d)[0][:, 0]


def storage(path: Path, **values: Any) -> Path:
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in values.items():
        file.write(key, value)
    file.release()
    return path


def as_json(path: Path, **values: Any) -> Path:
    path.write_text(json.dumps({key: np.asarray(value).tolist() for key, value in values.items()}))
    return path


def as_yaml(path: Path, **values: Any) -> Path:
    path.write_text(yaml.safe_dump({key: np.asarray(value).tolist() for key, value in values.items()}))
    return path


WRITERS = {"yml": storage, "xml": storage, "json": as_json, "yaml": as_yaml}
WORDS = [
    ("camera_matrix", "dist_coeff"),
    ("mtx", "dist"),
    ("cameraMatrix", "distCoeffs"),
    ("CameraMat", "DistCoeff"),
    ("K", "D"),
    ("intrinsic_matrix", "Distortion-Coefficients"),
    ("camMtx", "dist_coefs"),
]


@pytest.mark.parametrize("ending", WRITERS)
@pytest.mark.parametrize("words", WORDS)
def test_distortion_under_any_common_name_is_read(
    tmp_path: Path, ending: str, words: tuple[str, str]
) -> None:
    if ending in ("yml", "xml") and "-" in words[1]:
        words = (words[0], words[1].replace("-", "_"))
    write: Callable[..., Path] = WRITERS[ending]
    file = write(tmp_path / f"a.{ending}", **{words[0]: K, words[1]: np.array([BROWN])})
    (camera,) = raycam.load_cameras(file, size=SIZE).values()
    pixels, _ = camera.project(POINTS)
    np.testing.assert_allclose(pixels, projected(BROWN), atol=1e-9)


@pytest.mark.parametrize(
    "lens",
    [
        {"distorsions": BROWN},
        {"lens_params": BROWN},
        {"radial_coefs_of_it": BROWN[:2]},
        {"calibration": {"dist": BROWN}},
        {"extra": [{"k1": 0.1}]},
    ],
)
def test_distortion_of_an_unknown_form_raises(tmp_path: Path, lens: dict[str, Any]) -> None:
    file = tmp_path / "a.json"
    file.write_text(json.dumps({"K": K.tolist(), "image_size": SIZE, **lens}))
    with raises(FormatError, code="syntax", mentions=["a.json", next(iter(lens))]):
        raycam.load_cameras(file)
    # Coefficients of 0 have no effect, and `distance` is not a distortion.
    file.write_text(json.dumps({"K": K.tolist(), "image_size": SIZE, "distorsions": [0, 0], "distance": 3}))
    assert raycam.load_cameras(file)["a"].model == "pinhole"


@pytest.mark.parametrize("key", ["distortion", "Dist", "lens_distortion"])
def test_misnamed_distortion_raises_in_nerf_bop_ros_and_kalibr_files(tmp_path: Path, key: str) -> None:
    frame = {"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}
    nerf = {"fl_x": 500, "cx": 320, "cy": 240, "w": 640, "h": 480, "frames": [{**frame, key: BROWN}]}
    bop = {"0": {"cam_K": K.ravel().tolist(), "depth_scale": 1.0, key: BROWN}}
    ros = {"image_width": 640, "image_height": 480, "distortion_model": "plumb_bob", "K": K.ravel().tolist()}
    for text in (
        json.dumps(nerf),
        json.dumps(bop),
        yaml.safe_dump({**ros, "P": [0.0] * 12, key: BROWN}),
        yaml.safe_dump(
            {
                "cam0": {
                    "camera_model": "pinhole",
                    "intrinsics": [1, 1, 0, 0],
                    "resolution": list(SIZE),
                    key: BROWN,
                }
            }
        ),
    ):
        (tmp_path / "a").write_text(text)
        with raises(FormatError, code="syntax", mentions=["dist"]):
            raycam.load_cameras(tmp_path / "a", size=SIZE)


def test_four_coefficients_require_a_lens_model(tmp_path: Path) -> None:
    d = np.array(FISHEYE)
    asked = [
        storage(tmp_path / "a.yml", K=K, D=d[:, None]),
        as_json(tmp_path / "b.json", DIM=SIZE, K=K, D=d[:, None]),
        as_json(tmp_path / "c.json", K=K, D=d),
        as_json(tmp_path / "fisheye_d.json", mtx=K, dist=d),
        as_json(tmp_path / "e.json", K=K, k1=d[0], k2=d[1], k3=d[2], k4=d[3]),
    ]
    for file in asked:
        with raises(FormatError, code="syntax", mentions=['"opencv"', '"fisheye"']):
            raycam.load_cameras(file, size=SIZE)
        (camera,) = raycam.load_cameras(file, size=SIZE, model="fisheye").values()
        np.testing.assert_allclose(camera.project(POINTS)[0], projected(FISHEYE, True), atol=1e-9)
    (camera,) = raycam.load_cameras(asked[0], size=SIZE, model="opencv").values()
    np.testing.assert_allclose(camera.project(POINTS)[0], projected(FISHEYE), atol=1e-9)
    stated = as_json(tmp_path / "f.json", K=K, D=d, camera_model="fisheye")
    (camera,) = raycam.load_cameras(stated, size=SIZE).values()
    assert camera.model == "fisheye"
    with raises(FormatError, code="syntax", mentions=["f.json:1", "camera_model"]):
        raycam.load_cameras(stated, size=SIZE, model="opencv")
    # Four numbers under keys dist* have the order of OpenCV.
    (camera,) = raycam.load_cameras(as_json(tmp_path / "g.json", mtx=K, dist=d), size=SIZE).values()
    np.testing.assert_allclose(camera.project(POINTS)[0], projected(FISHEYE), atol=1e-9)


@pytest.mark.parametrize(
    "keys",
    [
        ("M1", "D1", "M2", "D2", "R", "T"),
        ("cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2", "R", "T"),
        ("mtxL", "distL", "mtxR", "distR", "Rot", "Trans"),
        ("K_left", "D_left", "K_right", "D_right", "rotation", "translation"),
        (
            "left_camera_matrix",
            "left_dist_coeffs",
            "right_camera_matrix",
            "right_dist_coeffs",
            "R_stereo",
            "t",
        ),
    ],
)
def test_stereo_pair_in_one_file_is_read_as_a_rig(tmp_path: Path, keys: tuple[str, ...]) -> None:
    right = K + np.array([[3.0, 0, 7.5], [0, 5.0, -2.25], [0, 0, 0]])
    rvec, t = np.array([0.01, -0.02, 0.03]), np.array([-0.12, 0.002, -0.001])
    d2 = np.array(BROWN) * 0.5
    values = (K, np.array(BROWN), right, d2, cv2.Rodrigues(rvec)[0], t)
    file = storage(tmp_path / "stereo.yml", **dict(zip(keys, values, strict=True)))
    (rig,) = raycam.load_cameras(file, size=SIZE).rigs.values()
    expected = [
        cv2.projectPoints(POINTS, np.zeros(3), np.zeros(3), K, np.array(BROWN))[0][:, 0],
        cv2.projectPoints(POINTS, rvec, t, right, d2)[0][:, 0],
    ]
    for camera, pixels in zip(rig.values(), expected, strict=True):
        np.testing.assert_allclose(camera.project(POINTS)[0], pixels, atol=1e-8)


def test_stereo_pair_in_two_files_is_read_as_a_rig(tmp_path: Path) -> None:
    five = np.array([BROWN])
    storage(tmp_path / "intrinsics.yml", M1=K, D1=five, M2=K, D2=five)
    storage(tmp_path / "extrinsics.yml", R=np.eye(3), T=np.array([-0.2, 0, 0]), Q=np.eye(4))
    for name in ("intrinsics.yml", "extrinsics.yml"):
        (rig,) = raycam.load_cameras(tmp_path / name, size=SIZE).rigs.values()
        np.testing.assert_allclose([camera.C for camera in rig.values()], [[0, 0, 0], [0.2, 0, 0]])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"K": K.T, "dist": BROWN}, fault("syntax", "a.json:1", "K")),
        (
            {"K": np.diag([1.2, 1.6, 1.0]) + np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])},
            fault("syntax", "a.json:1", "K"),
        ),
        (
            {"K": K, "camera_matrix": K * [[2, 1, 1], [1, 1, 1], [1, 1, 1]]},
            fault("syntax", "a.json:1", "camera_matrix"),
        ),
        ({"K": K, "dist": BROWN, "k1": 0.3}, fault("syntax", "a.json:1", "dist")),
        ({"K": K, "image_size": (480, 640)}, fault("syntax", "a.json:1", "image_size")),
        ({"K": K, "dist": BROWN, "model": "scaramuzza"}, fault("syntax", "scaramuzza")),
    ],
)
def test_common_mistakes_in_a_calibration_raise(
    tmp_path: Path, values: dict[str, Any], message: Fault
) -> None:
    file = tmp_path / "a.json"
    file.write_text(
        json.dumps({key: v if isinstance(v, str) else np.asarray(v).tolist() for key, v in values.items()})
    )
    with raises(FormatError, **message):
        raycam.load_cameras(file, size=SIZE)


def test_board_views_are_read_as_cameras(tmp_path: Path) -> None:
    rvecs, tvecs = np.array([[0.1, 0.2, 0.3], [-0.2, 0, 0.1]]), np.array([[1, 2, 13.0], [0, 1, 15]])
    file = as_json(tmp_path / "a.json", mtx=K, dist=BROWN, rvecs=rvecs[:, :, None], tvecs=tvecs[:, :, None])
    points = POINTS * 3
    for i, camera in enumerate(raycam.load_cameras(file, size=SIZE).values()):
        expected = cv2.projectPoints(points, rvecs[i], tvecs[i], K, np.array(BROWN))[0][:, 0]
        np.testing.assert_allclose(camera.project(points)[0], expected, atol=1e-8)


def test_unknown_lens_model_is_refused_with_the_nearest_name(tmp_path: Path) -> None:
    with raises(CameraError, code="invalid_camera", mentions=["fisheye"]):
        raycam.load_cameras(as_json(tmp_path / "a.json", K=K), size=SIZE, model="fishey")  # type: ignore[arg-type]


def test_json_with_comments_from_opencv_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    file.write("address", 'https://a.example/"b"')
    file.writeComment("flags: +fix_aspectRatio", False)
    file.write("image_width", 640)
    file.write("image_height", 480)
    file.write("camera_matrix", K)
    file.write("distortion_coefficients", np.array([BROWN]))
    file.release()
    assert "// flags" in path.read_text()
    (camera,) = raycam.load_cameras(path).values()
    np.testing.assert_allclose(camera.project(POINTS)[0], projected(BROWN), atol=1e-9)


def test_yaml_aliases_are_resolved(tmp_path: Path) -> None:
    shared = {"dist": BROWN, "image_size": list(SIZE)}
    table = {"front": {"K": K.tolist(), **shared}, "back": {"K": K.tolist(), **shared}}
    text = yaml.safe_dump(table)
    assert "*id001" in text
    (tmp_path / "a.yaml").write_text(text)
    for camera in raycam.load_cameras(tmp_path / "a.yaml").values():
        np.testing.assert_allclose(camera.project(POINTS)[0], projected(BROWN), atol=1e-9)
    rows = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1]"]
    rows += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 8)}]" for i in range(1, 12)]
    (tmp_path / "b.yaml").write_text("\n".join([*rows, f"K: {K.tolist()}", ""]))
    with raises(FormatError, code="syntax", mentions=["b.yaml"]):
        raycam.load_cameras(tmp_path / "b.yaml", format="opencv")


@pytest.mark.parametrize("nested", [False, True])
def test_named_intrinsics_and_coefficients_are_read(tmp_path: Path, nested: bool) -> None:
    k1, k2, p1, p2, k3 = BROWN
    table: dict[str, Any] = {
        "intrinsics": dict(zip(("fx", "fy", "cx", "cy"), (K[0, 0], K[1, 1], K[0, 2], K[1, 2]), strict=True)),
        "distortion": {"k1": k1, "k2": k2, "k3": k3, "p1": p1, "p2": p2},
        "image_size": {"height": 480, "width": 640},
    }
    (tmp_path / "a.json").write_text(json.dumps({"camera": table} if nested else table))
    (camera,) = raycam.load_cameras(tmp_path / "a.json").values()
    assert camera.size == SIZE
    np.testing.assert_allclose(camera.project(POINTS)[0], projected(BROWN), atol=1e-9)
    table["intrinsics"]["coeffs"] = BROWN
    (tmp_path / "a.json").write_text(json.dumps({"camera": table} if nested else table))
    with raises(FormatError, code="syntax", mentions=["a.json:1", "intrinsics.coeffs"]):
        raycam.load_cameras(tmp_path / "a.json")


def test_list_of_cameras_is_read(tmp_path: Path) -> None:
    rows = [{"name": name, "K": K.tolist(), "dist": BROWN, "image_size": SIZE} for name in ("a", "b")]
    (tmp_path / "a.json").write_text(json.dumps(rows))
    cameras = raycam.load_cameras(tmp_path / "a.json")
    assert list(cameras) == ["a", "b"]
    np.testing.assert_allclose(cameras["b"].project(POINTS)[0], projected(BROWN), atol=1e-9)


@pytest.mark.parametrize("beside", [{"dist": BROWN}, {"D": BROWN}, {"lens": {"k1": 0.1}}])
def test_distortion_outside_its_camera_table_raises(tmp_path: Path, beside: dict[str, Any]) -> None:
    for table in ({"calib": {"K": K.tolist()}, **beside}, {"cam": {"calib": {"K": K.tolist()}, **beside}}):
        (tmp_path / "a.json").write_text(json.dumps(table))
        with raises(FormatError, code="syntax", mentions=["a.json:1", "dist"]):
            raycam.load_cameras(tmp_path / "a.json", size=SIZE)


@pytest.mark.parametrize(
    "keys",
    [
        ("cam1_K", "cam1_D", "cam2_K", "cam2_D", "R", "T"),
        ("K0", "D0", "K1", "D1", "R", "T"),
        ("mtxL", "distL", "mtxR", "distR", "Rot", "Trns"),
        ("left", "left", "right", "right", "stereo", "stereo"),
    ],
)
def test_stereo_pairs_under_many_key_names_are_read(tmp_path: Path, keys: tuple[str, ...]) -> None:
    rvec, t = np.array([0.01, -0.02, 0.03]), np.array([-0.12, 0.002, -0.001])
    parts = (K, np.array(BROWN), K, np.array(BROWN) / 2, cv2.Rodrigues(rvec)[0], t)
    inner = ("K", "D", "K", "D", "R", "T")
    table: dict[str, Any] = {}
    for key, name, value in zip(keys, inner, parts, strict=True):
        if keys[0] == keys[1]:
            table.setdefault(key, {})[name] = value.tolist()
        else:
            table[key] = value.tolist()
    (tmp_path / "a.json").write_text(json.dumps(table))
    (rig,) = raycam.load_cameras(tmp_path / "a.json", size=SIZE).rigs.values()
    second = list(rig.values())[1]
    expected = cv2.projectPoints(POINTS, rvec, t, K, np.array(BROWN) / 2)[0][:, 0]
    np.testing.assert_allclose(second.project(POINTS)[0], expected, atol=1e-8)


@pytest.mark.parametrize("ending", ["yml", "json"])
def test_nan_and_infinity_raise_with_their_key(tmp_path: Path, ending: str) -> None:
    bad = K.copy()
    bad[0, 0] = np.nan
    file = WRITERS[ending](tmp_path / f"a.{ending}", camera_matrix=bad, dist=np.array([BROWN]))
    with raises(FormatError, code="wrong_type", mentions=["camera_matrix"]):
        raycam.load_cameras(file, size=SIZE)


def test_numpy_arrays_in_yaml_and_pickles_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(yaml.dump({"camera_matrix": K, "dist": np.array(BROWN)}))
    with raises(FormatError, code="unsupported_feature", mentions=["NumPy"]):
        raycam.load_cameras(tmp_path / "a.yaml")
    (tmp_path / "a.p").write_bytes(pickle.dumps({"mtx": K.tolist()}, protocol=0))
    with raises(FormatError, code="unsupported_feature", mentions=["np.savez"]):
        raycam.load_cameras(tmp_path / "a.p")


def test_file_of_opencvs_interactive_calibration_is_read(tmp_path: Path) -> None:
    # Standard deviations of the coefficients are not read as a lens; the size has its own key.
    for ending in ("yml", "xml"):
        file = storage(
            tmp_path / f"a.{ending}",
            framesCount=30,
            cameraResolution=np.array(SIZE),
            camera_matrix=K,
            camera_matrix_std_dev=np.full((4, 1), 0.3),
            dist_coeffs=np.array([BROWN]),
            dist_coeffs_std_dev=np.full((5, 1), 0.003),
        )
        (camera,) = raycam.load_cameras(file).values()
        assert camera.size == SIZE
        np.testing.assert_allclose(camera.project(POINTS)[0], projected(BROWN), atol=1e-8)


@pytest.mark.parametrize(
    "words", [("resolution", "640x480"), ("image_size", "640, 480"), ("dim", "640 X 480")]
)
def test_image_size_in_a_string_is_read(tmp_path: Path, words: tuple[str, str]) -> None:
    (tmp_path / "a.json").write_text(json.dumps({"K": K.tolist(), "dist": BROWN, words[0]: words[1]}))
    assert raycam.load_cameras(tmp_path / "a.json")["a"].size == SIZE
    (tmp_path / "a.json").write_text(json.dumps({"K": K.tolist(), "dist": BROWN, words[0]: "large"}))
    with raises(FormatError, code="syntax", mentions=["large"]):
        raycam.load_cameras(tmp_path / "a.json")


@pytest.mark.parametrize(
    "words", [("img_w", "img_h"), ("frame_width", "frame_height"), ("camera_width", "camera_height")]
)
def test_image_width_and_height_under_many_key_names_are_read(tmp_path: Path, words: tuple[str, str]) -> None:
    table = {"calibration_matrix": K.tolist(), "dist_vec": BROWN, **dict(zip(words, SIZE, strict=True))}
    (tmp_path / "a.json").write_text(json.dumps(table))
    (camera,) = raycam.load_cameras(tmp_path / "a.json").values()
    assert camera.size == SIZE
    np.testing.assert_allclose(camera.project(POINTS)[0], projected(BROWN), atol=1e-8)


@pytest.mark.parametrize("count", [2, 3, 6])
def test_separate_radial_and_tangential_terms_are_combined(tmp_path: Path, count: int) -> None:
    k = [-0.21, 0.083, 0.013, 0.02, -0.01, 0.004][:count]
    table = {"K": K.tolist(), "RadialDistortion": k, "TangentialDistortion": BROWN[2:4], "size": SIZE}
    (tmp_path / "a.json").write_text(json.dumps(table))
    (camera,) = raycam.load_cameras(tmp_path / "a.json").values()
    np.testing.assert_allclose(camera.project(POINTS)[0], projected([*k[:2], *BROWN[2:4], *k[2:]]), atol=1e-8)
    (tmp_path / "a.json").write_text(json.dumps({**table, "dist": BROWN}))
    with raises(FormatError, code="syntax", mentions=["a.json:1", "RadialDistortion"]):
        raycam.load_cameras(tmp_path / "a.json")


def test_skew_next_to_focal_lengths_is_read(tmp_path: Path) -> None:
    table: dict[str, Any] = {"fx": 812.25, "fy": 790.5, "cx": 331.5, "cy": 229.125, "skew": 1.5, "size": SIZE}
    (tmp_path / "a.json").write_text(json.dumps(table))
    (camera,) = raycam.load_cameras(tmp_path / "a.json").values()
    assert camera.K[0, 1] == 1.5
    (tmp_path / "a.json").write_text(json.dumps({"K": K.tolist(), "skew": 1.5, "size": SIZE}))
    with raises(FormatError, code="syntax", mentions=["a.json:1", "skew"]):
        raycam.load_cameras(tmp_path / "a.json")


def test_unknown_numbers_that_could_be_distortion_raise(tmp_path: Path) -> None:
    for numbers in (BROWN, BROWN[:4], [*BROWN, 0.1, 0.2, 0.3]):
        (tmp_path / "a.json").write_text(json.dumps({"K": K.tolist(), "brownish": numbers, "size": SIZE}))
        with raises(FormatError, code="syntax", mentions=["a.json:1", "brownish"]):
            raycam.load_cameras(tmp_path / "a.json")
    for harmless in (
        {"q": [0.5, 0.5, 0.5, 0.5]},
        {"crop": [1, 2, 30, 40]},
        {"gains": [1.5, 1.0, 2.5, 1.0], "dist": BROWN},
    ):
        (tmp_path / "a.json").write_text(json.dumps({"K": K.tolist(), "size": SIZE, **harmless}))
        notices = raycam.load_cameras(tmp_path / "a.json").notices
        assert has_notice(notices[:1], "ignored_key", next(iter(harmless)))


@pytest.mark.parametrize("names", [("cameraMatrix.txt", "cameraDistortion.txt"), ("mtx.csv", "dist.csv")])
def test_separate_text_files_for_matrix_and_distortion_are_combined(
    tmp_path: Path, names: tuple[str, str]
) -> None:
    for name, values in zip(names, (K, [BROWN]), strict=True):
        np.savetxt(tmp_path / name, values, delimiter=",")
    cameras = raycam.load_cameras(tmp_path / names[0], size=SIZE)
    assert has_notice(cameras.notices, "used_other_file", names[1])
    (camera,) = cameras.values()
    np.testing.assert_allclose(camera.project(POINTS)[0], projected(BROWN), atol=1e-8)
    (tmp_path / names[1]).write_text("k1 = 3")
    with raises(FormatError, code="syntax", mentions=[names[1]]):
        raycam.load_cameras(tmp_path / names[0], size=SIZE)


@pytest.mark.parametrize("key", ["k1k2p1p2k3", "fisheye_D", "radial", "tangential_params"])
def test_distortion_keys_of_unknown_order_raise(tmp_path: Path, key: str) -> None:
    k = [[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]
    path = as_json(tmp_path / "a.json", K=k, image_width=640, image_height=480, **{key: [0.1, 0.2, 0, 0, 0]})
    with raises(raycam.FormatError, code="syntax", mentions=["a.json:1"]):
        raycam.load_cameras(path)
    path = as_json(tmp_path / "a.json", K=k, image_width=640, image_height=480, kc=[0.1, 0.2, 0, 0, 0])
    (camera,) = raycam.load_cameras(path).values()
    assert camera.distortion is not None
    assert camera.distortion[:2].tolist() == [0.1, 0.2]


@pytest.mark.parametrize("flag", [True, 1, 1.0, np.int64(1), np.uint8(1)])
def test_calibration_flags_determine_the_lens_model(tmp_path: Path, flag: Any) -> None:
    coefficients = np.array([0.02, -0.01, 0.003, -0.001])
    np.savez(tmp_path / "a.npz", K=K, D=coefficients[:, None], image_size=np.array([640, 480]), fisheye=flag)
    (camera,) = raycam.load_cameras(tmp_path / "a.npz").values()
    assert camera.model == "fisheye"
    np.testing.assert_array_equal(camera.distortion, coefficients)
