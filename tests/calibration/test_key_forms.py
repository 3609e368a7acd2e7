"""Forms of keys and documents: names of the intrinsics, units in keys, nested extrinsics, tables, TOML, comments."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
import yaml
from scipy.spatial.transform import Rotation
from support.raises import has_notice, raises

K = np.array([[500.0, 0, 320], [0, 510, 240], [0, 0, 1]])
R = Rotation.from_rotvec([0.4, -0.7, 0.3]).as_matrix()
T = np.array([0.5, -1.0, 2.0])
MATRIX = np.block([[R, T[:, None]], [np.eye(4)[3:]]])
BASE = {"K": K.tolist(), "img_size": [640, 480]}
FOCALS = {"fx": 500, "fy": 510, "cx": 320, "cy": 240}


def load(path: Path, content: Any, **arguments: Any) -> raycam.Cameras:
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return raycam.load_cameras(path, **arguments)


def check(camera: raycam.Camera, t: Any = T) -> None:
    np.testing.assert_allclose(camera.K, K)
    np.testing.assert_allclose(camera.R, R, atol=1e-12)
    np.testing.assert_allclose(camera.C, -R.T @ np.asarray(t), atol=1e-9)


@pytest.mark.parametrize(
    "intrinsics",
    [
        {"fx_px": 500, "fy_px": 510, "cx_px": 320, "cy_px": 240},
        {"focal_length": [500, 510], "principal_point": [320, 240]},
        {"focal_length_px": [500, 510], "cx": 320, "cy": 240},
        {"focal_length_x": 500, "focal_length_y": 510, "principal_point_x": 320, "principal_point_y": 240},
        {"fx": 500, "fy": 510, "u0": 320, "v0": 240},
        {"fx": 500, "fy": 510, "ppx": 320, "ppy": 240},
        {"intrinsics": {"fx": 500, "fy": 510, "principal_point": [320, 240]}},
    ],
)
def test_intrinsics_are_read_under_usual_names(tmp_path: Path, intrinsics: dict[str, Any]) -> None:
    content = {**intrinsics, "width": 640, "height": 480}
    cameras = load(tmp_path / "a.json", content)
    np.testing.assert_array_equal(next(iter(cameras.values())).K, K)
    assert not has_notice(cameras.notices, "ignored_key"), cameras.notices


def test_one_focal_length_applies_to_both_axes(tmp_path: Path) -> None:
    content = {"f": 500, "cx": 320, "cy": 240, "w": 640, "h": 480}
    np.testing.assert_array_equal(
        load(tmp_path / "a.json", content)["a"].K, [[500, 0, 320], [0, 500, 240], [0, 0, 1]]
    )


def test_focal_length_in_millimetres_is_refused_with_the_conversion(tmp_path: Path) -> None:
    content = {"focal_length": 35, "principal_point": [960, 540], "image_size": [1920, 1080]}
    with raises(raycam.FormatError, mentions=["35", "millimetres", "pixels"]):
        load(tmp_path / "a.json", content)


def test_field_of_view_without_intrinsics_is_refused_with_the_formula(tmp_path: Path) -> None:
    with raises(raycam.FormatError, mentions=["field of view", "tan"]):
        load(tmp_path / "a.json", {"hfov": 90, "width": 640, "height": 480})


@pytest.mark.parametrize("key", ["T_mm", "translation_mm", "t (mm)", "tCm"])
def test_unit_in_the_key_of_a_translation_is_reported(tmp_path: Path, key: str) -> None:
    cameras = load(tmp_path / "a.json", {**BASE, "R": R.tolist(), key: (1000 * T).tolist()})
    check(cameras["a"], 1000 * T)
    unit = "cm" if "Cm" in key else "mm"
    assert has_notice(cameras.notices, "placed_cameras", unit, "not converted to metres"), cameras.notices


@pytest.mark.parametrize("key", ["t_m", "translation_meters", "T [m]"])
def test_metres_in_the_key_of_a_translation_give_no_notice(tmp_path: Path, key: str) -> None:
    cameras = load(tmp_path / "a.json", {**BASE, "R": R.tolist(), key: T.tolist()})
    check(cameras["a"])
    assert cameras.notices == ()


@pytest.mark.parametrize(
    ("key", "factor"), [("rvec_deg", 180 / np.pi), ("rotation_vector_degrees", 180 / np.pi), ("rvec_rad", 1)]
)
def test_unit_in_the_key_of_a_rotation_vector_is_applied(tmp_path: Path, key: str, factor: float) -> None:
    rvec = factor * Rotation.from_matrix(R).as_rotvec()
    check(load(tmp_path / "a.json", {**BASE, key: rvec.tolist(), "tvec": T.tolist()})["a"])


@pytest.mark.parametrize("key", ["euler_xyz_deg", "rpy_degrees", "rotation_deg"])
def test_angles_are_refused_with_a_message_about_angles(tmp_path: Path, key: str) -> None:
    with raises(raycam.FormatError, mentions=[key, "angles"]):
        load(tmp_path / "a.json", {**BASE, key: [10, 20, 30], "translation": T.tolist()})


@pytest.mark.parametrize(
    ("key", "matrix"),
    [
        ("world_to_camera", MATRIX),
        ("w2c", MATRIX),
        ("c2w", np.linalg.inv(MATRIX)),
        ("camera_to_world", np.linalg.inv(MATRIX)),
    ],
)
def test_transform_in_a_map_of_extrinsics_is_applied(tmp_path: Path, key: str, matrix: Any) -> None:
    camera = {**BASE, "extrinsics": {key: matrix.tolist()}}
    check(load(tmp_path / "a.json", camera)["a"])
    check(load(tmp_path / "b.json", {"front": camera, "back": BASE})["front"])


def test_transform_without_a_direction_in_a_map_of_extrinsics_is_refused(tmp_path: Path) -> None:
    camera = {**BASE, "extrinsics": {"matrix": MATRIX.tolist()}}
    with raises(raycam.FormatError, mentions=["extrinsics", "direction="]):
        load(tmp_path / "a.json", camera)
    check(load(tmp_path / "a.json", camera, direction="camera_from_world")["a"])


@pytest.mark.parametrize("is_nested", [False, True])
def test_list_items_with_a_name_as_only_key_become_named_cameras(tmp_path: Path, is_nested: bool) -> None:
    items = [{"front": BASE}, {"back": {**BASE, "K": (2 * K).tolist()}}]
    cameras = load(tmp_path / "a.json", {"cameras": items} if is_nested else items)
    assert list(cameras) == ["front", "back"]
    np.testing.assert_array_equal(cameras["front"].K, K)


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_table_of_intrinsics_is_read(tmp_path: Path, separator: str) -> None:
    rows = [
        ["name", "fx [px]", "fy [px]", "cx", "cy", "width", "height"],
        ["front", "500", "510", "320", "240", "640", "480"],
    ]
    rows.append(["back", *rows[1][1:]])
    text = "\ufeff# cameras\n" + "\n".join(separator.join(row) for row in rows) + "\n"
    cameras = load(tmp_path / "a.csv", text)
    assert list(cameras) == ["front", "back"]
    for camera in cameras.values():
        np.testing.assert_array_equal(camera.K, K)
        assert camera.size == (640, 480)


@pytest.mark.parametrize("head", ["", "# my camera\n", "[camera]\n"])
@pytest.mark.parametrize("ending", ["toml", "ini", "txt"])
def test_keys_with_equals_signs_are_read(tmp_path: Path, head: str, ending: str) -> None:
    lines = [f"{key} = {value}" for key, value in {**FOCALS, "width": 640, "height": 480}.items()]
    cameras = load(tmp_path / f"a.{ending}", head + "\n".join(lines) + "\n")
    np.testing.assert_array_equal(next(iter(cameras.values())).K, K)


def test_world_files_are_not_read_as_calibrations(tmp_path: Path) -> None:
    text = '[[object]]\nbox = {size = 1}\n[[camera]]\nname = "a"\nfx = 1\nfy = 1\ncx = 1\ncy = 1\n'
    with raises(raycam.FormatError, mentions=["world file", "raycam.load(path).cameras"]):
        load(tmp_path / "world.toml", text)


def test_comments_in_json_are_ignored(tmp_path: Path) -> None:
    text = f'// exported\n{{"K": /* rows */ {K.tolist()}, // "K"\n"name": "a // b /* c */", "img_size": [640, 480]}}'
    cameras = load(tmp_path / "c.json", text)
    assert list(cameras) == ["a // b /* c */"]
    np.testing.assert_array_equal(next(iter(cameras.values())).K, K)


def test_merge_keys_of_yaml_are_applied(tmp_path: Path) -> None:
    shared = {"base": BASE, "other": {"rms": 0.5}}
    left = {"R": R.tolist(), "T": T.tolist()}
    text = f"base: &b {json.dumps(shared['base'])}\nother: &o {json.dumps(shared['other'])}\n"
    text += f"left:\n  <<: [*b, *o]\n  R: {left['R']}\n  T: {left['T']}\nright:\n  <<: *b\n  img_size: [320, 240]\n"
    expected = yaml.safe_load(text)
    cameras = load(tmp_path / "a.yaml", text)
    check(cameras["left"])
    for name in ("left", "right"):
        assert cameras[name].size == tuple(expected[name]["img_size"])


@pytest.mark.parametrize("size", ["(640, 480)", "640\u00d7480", "640 x 480"])
def test_image_size_is_read_from_usual_spellings(tmp_path: Path, size: str) -> None:
    assert load(tmp_path / "a.json", {"K": K.tolist(), "resolution": size})["a"].size == (640, 480)


def test_image_size_may_be_in_a_map_of_the_image(tmp_path: Path) -> None:
    content = {"K": K.tolist(), "image": {"width": 640, "height": 480, "encoding": "bgr8"}}
    assert load(tmp_path / "a.json", content)["a"].size == (640, 480)


def test_lens_in_lists_of_radial_and_tangential_coefficients_is_read(tmp_path: Path) -> None:
    lens = {"radial": [0.1, -0.05, 0.01], "tangential": [0.001, 0.002]}
    camera = load(tmp_path / "a.json", {**BASE, "distortion": lens})["a"]
    np.testing.assert_array_equal(camera.distortion, [0.1, -0.05, 0.001, 0.002, 0.01])
    with raises(raycam.FormatError, mentions=["prism_coefficients"]):
        load(tmp_path / "b.json", {**BASE, "distortion": {**lens, "prism_coefficients": [0.1]}})


def test_model_in_a_map_next_to_the_coefficients_is_used(tmp_path: Path) -> None:
    content = {**BASE, "D": [0.1, 0.01, 0.001, 0.0001], "lens": {"type": "fisheye"}}
    assert load(tmp_path / "a.json", content)["a"].model == "fisheye"


@pytest.mark.parametrize("row", [[1e-17, -1e-18, 0, 1], [0, 0, 0, 0.9999999]])
def test_rounding_in_the_last_row_of_a_pose_is_accepted(tmp_path: Path, row: list[float]) -> None:
    check(load(tmp_path / "a.json", {**BASE, "w2c": [*MATRIX[:3].tolist(), row]})["a"])
    with raises(raycam.FormatError, mentions=["last row"]):
        load(tmp_path / "b.json", {**BASE, "w2c": [*MATRIX[:3].tolist(), [0, 0, 0, 0.999]]})


def test_pose_in_a_camera_matrix_next_to_k_is_read(tmp_path: Path) -> None:
    P = K @ MATRIX[:3]
    cameras = load(tmp_path / "a.json", {**BASE, "P": P.tolist()})
    check(cameras["a"])
    assert has_notice(cameras.notices, "assumed_convention", "P = K [R | t]")
    rectified = np.column_stack([K, [-50.0, 0, 0]])
    camera = load(tmp_path / "b.json", {**BASE, "P": rectified.tolist()})["b"]
    np.testing.assert_array_equal(camera.C, [0, 0, 0])


@pytest.mark.parametrize(
    "pose",
    [
        {"pose": {"x": 1, "y": 2, "z": 3, "roll": 0, "pitch": 0, "yaw": 90}},
        {"extrinsics": {"eye": [0, 0, 5], "target": [0, 0, 0]}},
        {"eye": [0, 0, 5], "center": [0, 0, 0], "up": [0, 1, 0]},
        {"location": [1, 2, 3], "rotation_quaternion": [1, 0, 0, 0]},
        {"location": [1, 2, 3], "rotation_euler": [0.1, 0.2, 0.3]},
    ],
)
def test_pose_in_an_unknown_form_is_refused(tmp_path: Path, pose: dict[str, Any]) -> None:
    with raises(raycam.FormatError, mentions=[list(pose)[-1] if "location" in pose else next(iter(pose))]):
        load(tmp_path / "a.json", {**BASE, **pose})


def test_baseline_without_r_and_t_is_refused(tmp_path: Path) -> None:
    for pair in (
        {"left": BASE, "right": BASE},
        {"K_left": K.tolist(), "K_right": K.tolist(), "size": [640, 480]},
    ):
        with raises(raycam.FormatError, mentions=["baseline", "[-baseline, 0, 0]"]):
            load(tmp_path / "a.json", {**pair, "baseline": 0.12})
        placed = {"R": np.eye(3).tolist(), "T": [-0.12, 0, 0]}
        cameras = load(tmp_path / "b.json", {**pair, "baseline": 0.12, **placed})
        np.testing.assert_allclose(cameras["right"].C, [0.12, 0, 0])


def test_focal_lengths_in_npz_files_are_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", **{**FOCALS, "width": 640, "height": 480})  # type: ignore[arg-type]
    camera = raycam.load_cameras(tmp_path / "a.npz")["a"]
    np.testing.assert_array_equal(camera.K, K)
    assert camera.size == (640, 480)


def test_json_lines_are_read_as_a_list(tmp_path: Path) -> None:
    lines = [json.dumps({"name": name, **BASE}) for name in ("front", "back")]
    cameras = load(tmp_path / "a.jsonl", "\n".join(lines) + "\n")
    assert list(cameras) == ["front", "back"]


@pytest.mark.parametrize(
    "text",
    [
        "[500 0 320; 0 510 240; 0 0 1]",
        "500 0 320 0 510 240 0 0 1",
        "500, 0, 320, 0, 510, 240, 0, 0, 1",
        "[[500., 0., 320.], [0., 510., 240.], [0., 0., 1.]]",
        "[[500 0 320]\n [0 510 240]\n [0 0 1]]",
        "np.array([[500.0, 0, 320], [0, 510, 240], [0, 0, 1]])",
        "500;0;320;0;510;240;0;0;1",
        "(500, 510, 320, 240)",
    ],
)
def test_camera_matrix_and_coefficients_may_be_texts(tmp_path: Path, text: str) -> None:
    cameras = load(
        tmp_path / "a.json",
        {"K": text, "dist": "[0.1, -0.2, 0, 0]", "img_size": [640, 480], "model": "opencv"},
    )
    np.testing.assert_array_equal(cameras["a"].K, K)
    np.testing.assert_array_equal(cameras["a"].distortion, [0.1, -0.2, 0, 0])


def test_text_with_decimal_commas_is_refused(tmp_path: Path) -> None:
    with raises(raycam.FormatError, mentions=["K", "320,5", "decimal commas"]):
        load(tmp_path / "a.json", {"K": "500,0 510,0 320,5 240,5", "img_size": [640, 480]})


@pytest.mark.parametrize(
    ("content", "names"),
    [
        ({**FOCALS, "flx": 600}, ["flx", "fx"]),
        ({**FOCALS, "u0": 321}, ["u0", "cx"]),
        ({**FOCALS, "principal_point": [310, 240]}, ["principal_point", "cx"]),
        ({"K": K.tolist(), "fx": 600}, ["fx", "K"]),
        ({"K": K.tolist(), "cy": 250}, ["cy", "K"]),
        ({**FOCALS, "resolution": [1280, 960]}, ["width", "resolution"]),
    ],
)
def test_two_values_of_one_quantity_are_refused_with_both_names(
    tmp_path: Path, content: dict[str, Any], names: list[str]
) -> None:
    with raises(raycam.FormatError, mentions=[*names, "different value for the same quantity"]):
        load(tmp_path / "a.json", {"width": 640, "height": 480, **content})


def test_equal_and_rounded_values_of_one_quantity_are_accepted(tmp_path: Path) -> None:
    content = {**BASE, "fx": 500.0001, "cx": 320, "width": 640, "height": 480}
    np.testing.assert_array_equal(load(tmp_path / "a.json", content)["a"].K, K)


@pytest.mark.parametrize("key", ["units", "unit", "length_unit", "translation_units"])
@pytest.mark.parametrize("name", ["mm", "Millimeters"])
def test_unit_of_a_file_is_reported(tmp_path: Path, key: str, name: str) -> None:
    cameras = load(tmp_path / "a.json", {key: name, **BASE, "R": R.tolist(), "T": (1000 * T).tolist()})
    check(cameras["a"], 1000 * T)
    assert has_notice(cameras.notices, "placed_cameras", key, "mm", "not converted to metres"), (
        cameras.notices
    )


def test_metres_as_the_unit_of_a_file_give_no_notice(tmp_path: Path) -> None:
    assert load(tmp_path / "a.json", {"units": "m", **BASE, "R": R.tolist(), "T": T.tolist()}).notices == ()


def test_unit_of_a_list_of_poses_is_reported(tmp_path: Path) -> None:
    content = {"unit": "cm", "poses": [MATRIX.tolist(), MATRIX.tolist()]}
    camera = raycam.Camera(K, np.eye(3), np.zeros(3), (640, 480))
    cameras = load(
        tmp_path / "a.json", content, intrinsics=camera, direction="camera_from_world", axes="opencv"
    )
    assert has_notice(cameras.notices, "placed_cameras", "unit", "cm"), cameras.notices


@pytest.mark.parametrize(
    "content",
    [
        {
            "focal_length": {"fx": 500, "fy": 510},
            "principal_point": {"cx": 320, "cy": 240},
            "width": 640,
            "height": 480,
        },
        {"focal": {"x": 500, "y": 510}, "principal_point": {"x": 320, "y": 240}, "resolution_hw": [480, 640]},
        {"camera_matrix_3x3": K.tolist(), "image_size": [640, 480]},
        {
            "intrinsic_settings": {"resX": 640, "resY": 480, **FOCALS},
            "captured_image_size": {"width": 640, "height": 480},
        },
    ],
)
def test_intrinsics_are_read_from_further_forms(tmp_path: Path, content: dict[str, Any]) -> None:
    cameras = load(tmp_path / "a.json", content)
    np.testing.assert_array_equal(cameras["a"].K, K)
    assert cameras["a"].size == (640, 480)


def test_rotation_and_position_in_unknown_keys_are_refused(tmp_path: Path) -> None:
    content = {**BASE, "position_world_m": [1, 2, 3], "quaternion_world_opengl": [0.5, 0.5, 0.5, 0.5]}
    with raises(raycam.FormatError, mentions=["quaternion_world_opengl", "position_world_m", "c2w"]):
        load(tmp_path / "a.json", content)


def test_position_next_to_a_pose_of_unknown_direction_asks_for_the_direction(tmp_path: Path) -> None:
    content = {**BASE, "camera_rt_matrix": MATRIX.tolist(), "camera_location": [1, 2, 3]}
    with raises(raycam.FormatError, mentions=["camera_rt_matrix", "direction"]):
        load(tmp_path / "a.json", content)
    check(load(tmp_path / "a.json", content, direction="camera_from_world")["a"])


@pytest.mark.parametrize(
    ("key", "is_inverse"),
    [
        ("camera_to_robot_transform", True),
        ("c2w", True),
        ("w2c", False),
        ("robot_to_camera", False),
        ("extrinsics", False),
    ],
)
def test_key_of_a_map_with_rotation_and_translation_states_the_direction(
    tmp_path: Path, key: str, is_inverse: bool
) -> None:
    content = {**BASE, key: {"rotation_matrix": R.tolist(), "translation": T.tolist()}}
    camera = load(tmp_path / "a.json", content)["a"]
    np.testing.assert_allclose(camera.R, R.T if is_inverse else R, atol=1e-12)
    np.testing.assert_allclose(camera.C, T if is_inverse else -R.T @ T, atol=1e-12)


def test_direction_applies_to_a_map_with_rotation_and_translation(tmp_path: Path) -> None:
    content = {**BASE, "extrinsics": {"R": R.tolist(), "T": T.tolist()}}
    camera = load(tmp_path / "a.json", content, direction="world_from_camera")["a"]
    np.testing.assert_allclose(camera.C, T, atol=1e-12)


def test_matrix_of_a_pose_under_a_key_of_the_camera_matrix_is_the_pose(tmp_path: Path) -> None:
    """OpenPose's files contain [R | t] in CameraMatrix, and K in Intrinsics."""
    content = {
        "CameraMatrix": MATRIX[:3].tolist(),
        "Intrinsics": K.tolist(),
        "Distortion": [0.1, 0, 0, 0, 0, 0, 0, 0],
    }
    cameras = load(tmp_path / "a.json", content, size=(640, 480))
    check(cameras["a"])
    assert has_notice(cameras.notices, "assumed_convention", "CameraMatrix"), cameras.notices


def test_coefficients_under_k_are_not_the_camera_matrix(tmp_path: Path) -> None:
    content = {"camera_mtx": K.tolist(), "k": [0.03, -0.03, -0.0007, -0.001, 0.002], "img_size": [640, 480]}
    with raises(raycam.FormatError, mentions=["k", "dist_coeffs"]):
        load(tmp_path / "a.json", content)


def test_camera_matrix_under_cam_k_without_images_is_not_a_bop_file(tmp_path: Path) -> None:
    content = {"cam_D": [0.1, 0, 0, 0, 0], "cam_K": K.ravel().tolist(), "width": 640, "height": 480}
    np.testing.assert_array_equal(load(tmp_path / "a.json", content)["a"].K, K)


def test_identity_rotation_without_translation_is_no_pose(tmp_path: Path) -> None:
    """The form of iai_kinect2, whose rotation and projection belong to the rectified image."""
    camera = load(tmp_path / "a.json", {**BASE, "rotation": np.eye(3).tolist()})["a"]
    np.testing.assert_array_equal(camera.C, np.zeros(3))


@pytest.mark.parametrize(("model", "lens"), [("fisheye", "fisheye"), ("opencv", "opencv"), ("omni", "omni")])
def test_xi_of_zero_does_not_override_the_stated_lens_model(tmp_path: Path, model: str, lens: str) -> None:
    camera = load(tmp_path / "a.json", {**BASE, "model": model, "xi": 0, "D": [0.1, 0.01, 0.001, 0.0001]})[
        "a"
    ]
    assert camera.model == lens


def test_xi_next_to_another_lens_model_is_refused(tmp_path: Path) -> None:
    with raises(raycam.FormatError, mentions=["fisheye", "xi", 1.2]):
        load(tmp_path / "a.json", {**BASE, "model": "fisheye", "xi": 1.2, "D": [0.1, 0.01, 0.001, 0.0001]})


def test_maps_of_matrices_by_camera_name_are_cameras(tmp_path: Path) -> None:
    content = {
        "K": {"a": K.tolist(), "b": K.tolist()},
        "dist": {"a": [0.1, 0, 0, 0, 0]},
        "w2c": {"a": MATRIX.tolist(), "b": np.eye(4).tolist()},
        "image_size": [640, 480],
    }
    cameras = load(tmp_path / "a.json", content)
    assert list(cameras) == ["a", "b"]
    check(cameras["a"])
    np.testing.assert_array_equal(cameras["a"].distortion, [0.1, 0, 0, 0, 0])
    assert cameras["b"].model == "pinhole"
