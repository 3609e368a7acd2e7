"""Camera matrices P in files of numbers only: text, NumPy arrays, JSON and folders, judged by OpenCV."""

import json
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
import raycam
from support.raises import raises

SIZE = (640, 480)
POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.5, -0.25], [-0.5, 0.75, 0.5]])


def camera_matrices(count: int) -> npt.NDArray[np.float64]:
    """Shape (count, 3, 4): cameras around the origin, made with OpenCV's Rodrigues rotations."""
    k = np.array([[500.0, 0.5, 310.0], [0.0, 510.0, 250.0], [0.0, 0.0, 1.0]])
    made = []
    for i in range(count):
        r, _ = cv2.Rodrigues(np.array([1.9, 0.1 * i, 0.2]))
        made.append(k @ np.c_[r, [0.1 * i, -0.2, 5.0]])
    return np.stack(made)


def pixels(p: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Pixels of POINTS by the definition of P; integers are pixel centres, as in OpenCV."""
    projected = np.c_[POINTS, np.ones(len(POINTS))] @ p.T
    return projected[:, :2] / projected[:, 2:]


def as_rows(path: Path, p: npt.NDArray[np.float64]) -> None:
    np.savetxt(path, p.reshape(-1, 4))


def as_lines(path: Path, p: npt.NDArray[np.float64]) -> None:
    np.savetxt(path, p.reshape(-1, 12))


def as_array(path: Path, p: npt.NDArray[np.float64]) -> None:
    np.save(path, p)


def as_archive(path: Path, p: npt.NDArray[np.float64]) -> None:
    np.savez(path, p)


def as_json(path: Path, p: npt.NDArray[np.float64]) -> None:
    path.write_text(json.dumps(p.tolist()))


WRITERS = {
    "rows.txt": as_rows,
    "lines.txt": as_lines,
    "p.npy": as_array,
    "p.npz": as_archive,
    "p.json": as_json,
}


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("count", [1, 2, 4])
def test_file_of_camera_matrices_projects_like_them(tmp_path: Path, name: str, count: int) -> None:
    expected = camera_matrices(count)
    WRITERS[name](tmp_path / name, expected)
    cameras = raycam.load_cameras(tmp_path / name, size=SIZE)
    assert len(cameras) == count
    for camera, p in zip(cameras.values(), expected, strict=True):
        np.testing.assert_allclose(camera.project(POINTS)[0], pixels(p), atol=1e-6)


@pytest.mark.parametrize("scale", [1e-3, 1.0, -250.0])
def test_camera_matrix_may_have_any_scale(tmp_path: Path, scale: float) -> None:
    expected = camera_matrices(1)
    as_array(tmp_path / "p.npy", scale * expected)
    (camera,) = raycam.load_cameras(tmp_path / "p.npy", size=SIZE).values()
    np.testing.assert_allclose(camera.project(POINTS)[0], pixels(expected[0]), atol=1e-6)


def test_folder_of_camera_matrices_has_one_camera_per_file(tmp_path: Path) -> None:
    expected = camera_matrices(3)
    for i, p in enumerate(expected, start=1):
        as_rows(tmp_path / f"pos_{i:03}.txt", p)
    cameras = raycam.load_cameras(tmp_path, size=SIZE)
    assert list(cameras) == ["pos_001", "pos_002", "pos_003"]
    for camera, p in zip(cameras.values(), expected, strict=True):
        np.testing.assert_allclose(camera.project(POINTS)[0], pixels(p), atol=1e-6)


@pytest.mark.parametrize("name", WRITERS)
def test_camera_matrix_in_units_of_the_image_size_is_refused_with_the_conversion(
    tmp_path: Path, name: str
) -> None:
    to_units = np.diag([1.0 / SIZE[0], 1.0 / SIZE[1], 1.0])
    WRITERS[name](tmp_path / name, to_units @ camera_matrices(2))
    with raises(raycam.FormatError, code="syntax", mentions=["multiply the first row"]):
        raycam.load_cameras(tmp_path / name, size=SIZE)


def test_pose_with_a_wrong_rotation_is_not_taken_for_a_camera_matrix(tmp_path: Path) -> None:
    r, _ = cv2.Rodrigues(np.array([1.9, 0.1, 0.2]))
    pose = np.c_[r + 0.05, [0.0, 0.0, 5.0]]
    as_array(tmp_path / "poses.npy", pose[None])
    with raises(raycam.FormatError, code="syntax", mentions=["poses.npy:1", "rotation"]):
        raycam.load_cameras(tmp_path / "poses.npy", size=SIZE)


def test_matrix_of_another_kind_in_a_file_of_camera_matrices_is_an_error(tmp_path: Path) -> None:
    mixed = camera_matrices(2)
    mixed[1] = np.eye(4)[:3]
    as_rows(tmp_path / "p.txt", mixed)
    with raises(raycam.FormatError, code="syntax", mentions=["p.txt:6"]):
        raycam.load_cameras(tmp_path / "p.txt", size=SIZE)


@pytest.mark.parametrize(
    "text",
    [
        "t;x;y;z;qx;qy;qz;qw\n0,0;1,5;2,5;3,5;0,0;0,0;0,0;1,0\n",
        "0,0 1,5 2,5 3,5 0,0 0,0 0,0 1,0\n",
        "1,0 0,0 0,0 1,5\n0,0 1,0 0,0 2,5\n0,0 0,0 1,0 3,5\n0,0 0,0 0,0 1,0\n",
        "# fx fy cx cy\n500,25\t500,5\t320,0\t-240,0\n",
    ],
)
def test_error_names_the_decimal_comma(tmp_path: Path, text: str) -> None:
    (tmp_path / "poses.txt").write_text(text)
    with raises(raycam.FormatError, code="syntax", mentions=["decimal commas"]):
        raycam.load_cameras(tmp_path / "poses.txt")
