"""Poses as matrices, and trajectories of devices, compared with closed forms."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.errors import CameraError, FormatError
from scipy.spatial.transform import Rotation
from support.camera_truth import OPENGL, check, four, intrinsics, picture, pose, rows
from support.raises import Fault, fault, has_notice, raises

K = intrinsics(520.5, 518.25, 321.0, 242.5)
SIZE = (640, 480)
EYE = raycam.Camera(K, np.eye(3), np.zeros(3), SIZE)


def world_from_camera(seed: int) -> Any:
    R, C = pose(seed)
    return four(R.T, C)


def lines(matrices: list[Any]) -> str:
    return "".join(" ".join(repr(float(v)) for v in matrix.ravel()) + "\n" for matrix in matrices)


def check_all(cameras: raycam.Cameras, count: int, K: Any = K) -> None:
    assert len(cameras) == count
    for seed, camera in enumerate(cameras.values()):
        check(camera, K, *pose(seed))


def test_scannet_poses_are_read(tmp_path: Path) -> None:
    for i in range(12):
        text = rows(world_from_camera(i) if i != 11 else np.full((4, 4), -np.inf))
        (tmp_path / "pose").mkdir(exist_ok=True)
        (tmp_path / "pose" / f"{i}.txt").write_text(text)
    (tmp_path / "intrinsic").mkdir()
    (tmp_path / "intrinsic/intrinsic_color.txt").write_text(rows(four(K, np.zeros(3))))
    (tmp_path / "intrinsic/intrinsic_depth.txt").write_text(
        rows(four(0.5 * K + np.diag([0, 0, 0.5]), np.zeros(3)))
    )
    picture(tmp_path / "color/0.jpg")
    for folder in (tmp_path, tmp_path / "pose"):
        cameras = raycam.load_cameras(folder)
        assert list(cameras) == [str(i) for i in range(11)]  # the pose 2 comes before the pose 10
        check_all(cameras, 11)
        told = " ".join(map(str, cameras.notices))
        assert has_notice(cameras.notices, "ignored_element", "frame 11")
        assert "world_from_camera" in told
        assert "intrinsic_depth.txt contains another K" in told
    assert cameras["3"].size == SIZE
    (tmp_path / "color/0.jpg").rename(tmp_path / "color/000000.jpg")
    assert raycam.load_cameras(tmp_path)["3"].size == SIZE


@pytest.mark.parametrize("between", ["\t", " ", ", "])
def test_seven_scenes_poses_are_read(tmp_path: Path, between: str) -> None:
    for i in range(3):
        text = rows(world_from_camera(i)).replace(" ", between)
        (tmp_path / f"frame-{i:06d}.pose.txt").write_text(text)
    cameras = raycam.load_cameras(tmp_path, intrinsics=EYE)
    assert list(cameras) == [f"frame-{i:06d}" for i in range(3)]
    check_all(cameras, 3)
    with raises(CameraError, code="missing_argument", mentions=['"frame-000000"']):
        raycam.load_cameras(tmp_path)["frame-000000"]


@pytest.mark.parametrize("kind", ["lines", "blocks", "npy", "index"])
def test_matrices_in_one_text_file_are_read(tmp_path: Path, kind: str) -> None:
    matrices = [world_from_camera(i) for i in range(4)]
    file = tmp_path / "traj.txt"
    if kind == "npy":
        file = tmp_path / "traj.npy"
        np.save(file, np.asfortranarray(np.array(matrices)))
    elif kind == "index":
        file.write_text(
            "".join(f"{3 * i + 1} {line} \n" for i, line in enumerate(lines(matrices).splitlines()))
        )
    else:
        file.write_text(lines(matrices) if kind == "lines" else "".join(map(rows, matrices)))
    cameras = raycam.load_cameras(file, intrinsics=EYE)
    check_all(cameras, 4)
    if kind == "index":
        assert list(cameras) == ["1", "4", "7", "10"]
    assert [notice.code for notice in cameras.notices].count("assumed_convention") == 1


@pytest.mark.parametrize("direction", ["world_from_camera", "camera_from_world"])
@pytest.mark.parametrize("axes", ["opencv", "opengl"])
def test_matrices_follow_the_given_direction_and_axes(tmp_path: Path, direction: Any, axes: Any) -> None:
    found = []
    for i in range(3):
        R, C = pose(i)
        turn = four(OPENGL if axes == "opengl" else np.eye(3), np.zeros(3))
        matrix = four(R.T, C) @ turn
        found.append(matrix if direction == "world_from_camera" else np.linalg.inv(matrix))
    file = tmp_path / "poses.txt"
    file.write_text(lines(found))
    cameras = raycam.load_cameras(file, intrinsics=EYE, direction=direction, axes=axes)
    check_all(cameras, 3)
    assert not cameras.notices


def test_file_name_determines_the_pose_direction(tmp_path: Path) -> None:
    file = tmp_path / "w2c.txt"
    file.write_text(lines([np.linalg.inv(world_from_camera(i)) for i in range(3)]))
    cameras = raycam.load_cameras(file, intrinsics=EYE)
    check_all(cameras, 3)
    assert has_notice(cameras.notices, "assumed_convention", "camera_from_world")


@pytest.mark.parametrize(
    ("matrix", "reason"),
    [
        (world_from_camera(1).T, fault("syntax", ".txt:")),
        (four(np.diag([1.0, 1, -1]), np.ones(3)), fault("syntax", ".txt:")),
        (four(2 * np.eye(3), np.ones(3)), fault("syntax", ".txt:")),
        (np.vstack([np.eye(3, 4), [[0, 0, 1, 1]]]), fault("syntax", ".txt:")),
    ],
)
def test_matrices_that_are_not_poses_are_refused(tmp_path: Path, matrix: Any, reason: Fault) -> None:
    for file in (tmp_path / "a.txt", tmp_path / "lines.txt"):
        file.write_text(rows(matrix) if file.stem == "a" else lines([np.eye(4), matrix]))
        with raises(FormatError, **reason):
            raycam.load_cameras(file, intrinsics=EYE)


def test_replica_intrinsics_are_read_from_cam_params_json(tmp_path: Path) -> None:
    (tmp_path / "traj.txt").write_text(lines([world_from_camera(i) for i in range(3)]))
    parameters = {"w": 640, "h": 480, "fx": 520.5, "fy": 518.25, "cx": 321.0, "cy": 242.5, "scale": 6553.5}
    (tmp_path / "cam_params.json").write_text(json.dumps({"camera": parameters}))
    check_all(raycam.load_cameras(tmp_path), 3)


def test_kitti360_poses_are_read(tmp_path: Path) -> None:
    mount = four(
        Rotation.from_euler("xyz", [100, 5, 80], degrees=True).as_matrix(), np.array([0.8, 0.3, 1.7])
    )
    bodies = [world_from_camera(i) @ np.linalg.inv(mount) for i in range(3)]
    text = "".join(
        f"{5 * i} {' '.join(repr(float(v)) for v in b[:3].ravel())}\n" for i, b in enumerate(bodies)
    )
    (tmp_path / "poses.txt").write_text(text)
    eye = EYE.at_pose(mount[:3, :3].T, mount[:3, 3])
    cameras = raycam.load_cameras(tmp_path / "poses.txt", intrinsics=eye)
    check_all(cameras, 3)
    assert list(cameras) == ["0", "5", "10"]
    alone = raycam.load_cameras(tmp_path / "poses.txt", intrinsics=EYE)
    assert has_notice(alone.notices, "placed_cameras", "KITTI-360", "mount")
    (tmp_path / "calib_cam_to_pose.txt").write_text(
        "image_00: " + " ".join(repr(float(v)) for v in mount[:3].ravel()) + "\n"
    )
    rectified = Rotation.from_euler("xyz", [1, 2, 3], degrees=True).as_matrix()
    p = " ".join(repr(float(v)) for v in np.column_stack([K, np.zeros(3)]).ravel())
    (tmp_path / "perspective.txt").write_text(
        f"S_rect_00: 640 480\nR_rect_00: {' '.join(repr(float(v)) for v in rectified.ravel())}\nP_rect_00: {p}\n"
    )
    (camera,) = raycam.load_cameras(tmp_path / "calib_cam_to_pose.txt").values()
    check(camera, K, rectified @ mount[:3, :3].T, mount[:3, 3])


def open3d(columns: bool = True) -> dict[str, Any]:
    def numbers(matrix: Any) -> list[float]:
        return (matrix.T if columns else matrix).ravel().tolist()

    return {
        "class_name": "PinholeCameraTrajectory",
        "version_major": 1,
        "version_minor": 0,
        "parameters": [
            {
                "class_name": "PinholeCameraParameters",
                "extrinsic": numbers(np.linalg.inv(world_from_camera(i))),
                "intrinsic": {"width": 640, "height": 480, "intrinsic_matrix": numbers(K)},
                "version_major": 1,
                "version_minor": 0,
            }
            for i in range(3)
        ],
    }


def test_open3d_camera_files_are_read(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_text(json.dumps(open3d(), indent="\t"))
    check_all(raycam.load_cameras(file), 3)
    file.write_text(json.dumps(open3d()["parameters"][2]))
    check(next(iter(raycam.load_cameras(file).values())), K, *pose(2))
    file.write_text(json.dumps({"width": 640, "height": 480, "intrinsic_matrix": K.T.ravel().tolist()}))
    check(next(iter(raycam.load_cameras(file).values())), K, np.eye(3), np.zeros(3))
    file.write_text(json.dumps(open3d(columns=False)))
    with raises(
        FormatError, code="syntax", mentions=["a.json:1", "parameters[0].intrinsic.intrinsic_matrix"]
    ):
        raycam.load_cameras(file)


def pose_graph(count: int) -> dict[str, Any]:
    version = {"version_major": 1, "version_minor": 0}
    nodes = [
        {"class_name": "PoseGraphNode", "pose": world_from_camera(i).T.ravel().tolist(), **version}
        for i in range(count)
    ]
    edge = {
        "class_name": "PoseGraphEdge",
        "confidence": 1.0,
        "information": np.eye(6).ravel().tolist(),
        "source_node_id": 0,
        "target_node_id": 1,
        "transformation": np.eye(4).ravel().tolist(),
        "uncertain": False,
        **version,
    }
    return {"class_name": "PoseGraph", "edges": [edge], "nodes": nodes, **version}


def test_nodes_of_an_open3d_pose_graph_are_read(tmp_path: Path) -> None:
    file = tmp_path / "fragment_optimized.json"
    file.write_text(json.dumps(pose_graph(3), indent="\t"))
    cameras = raycam.load_cameras(file, intrinsics=EYE)
    check_all(cameras, 3)
    assert has_notice(cameras.notices, "assumed_convention", "world_from_camera")
    graph = pose_graph(2)
    graph["nodes"][1]["pose"] = world_from_camera(1).ravel().tolist()
    file.write_text(json.dumps(graph))
    with raises(FormatError, code="syntax", mentions=["nodes[1].pose"]):
        raycam.load_cameras(file, intrinsics=EYE)


def test_redwood_trajectories_are_read(tmp_path: Path) -> None:
    file = tmp_path / "a.log"
    file.write_text("".join(f"{i} {i} 0.97\n{rows(world_from_camera(i))}" for i in range(3)))
    check_all(raycam.load_cameras(file, intrinsics=EYE), 3)
    file.write_text(file.read_text()[:-40])
    with raises(FormatError, code="syntax", mentions=["a.log:11"]):
        raycam.load_cameras(file, intrinsics=EYE)


def test_arkitscenes_trajectories_are_read(tmp_path: Path) -> None:
    text = ""
    (tmp_path / "lowres_wide_intrinsics").mkdir()
    for i in range(4):
        R, C = pose(i)
        vector, t = Rotation.from_matrix(R).as_rotvec(), -R @ C
        text += f"{100.5 + 0.1 * i:.6f} " + " ".join(repr(float(v)) for v in [*vector, *t]) + "\n"
        if i != 3:
            name = f"lowres_wide_intrinsics/4711_{100.5 + 0.1 * i:.3f}.pincam"
            (tmp_path / name).write_text(f"640 480 520.5 518.25 321.0 {242.5 + i}\n")
    (tmp_path / "lowres_wide.traj").write_text(text)
    cameras = raycam.load_cameras(tmp_path / "lowres_wide.traj")
    assert list(cameras) == ["4711_100.500", "4711_100.600", "4711_100.700"]
    for i, camera in enumerate(cameras.values()):
        check(camera, intrinsics(520.5, 518.25, 321.0, 242.5 + i), *pose(i))
    assert has_notice(cameras.notices, "ignored_element", 1, ".pincam")
    assert list(raycam.load_cameras(tmp_path)) == list(cameras)
    check_all(raycam.load_cameras(tmp_path / "lowres_wide.traj", intrinsics=EYE), 4)


def euroc(columns: int, ending: str = "\n") -> str:
    text = "#timestamp, p_RS_R_x [m], ..." + ending
    for i in range(3):
        R, C = pose(i)
        x, y, z, w = Rotation.from_matrix(R.T).as_quat()
        values = [*C, w, x, y, z, *([0.0] * 9)][: columns - 1]
        text += ", ".join([str(1403636580838555648 + 5_000_000 * i), *map(repr, map(float, values))]) + ending
    return text


@pytest.mark.parametrize(("columns", "ending"), [(17, "\n"), (8, "\r\n")])
def test_euroc_trajectories_are_read(tmp_path: Path, columns: int, ending: str) -> None:
    file = tmp_path / "data.csv"
    file.write_bytes(euroc(columns, ending).encode())
    mount = four(
        Rotation.from_euler("xyz", [90, 5, 80], degrees=True).as_matrix(), np.array([-0.02, -0.06, 0.01])
    )
    sensor = tmp_path / "sensor.yaml"
    numbers = ", ".join(repr(float(v)) for v in mount.ravel())
    sensor.write_text(
        f"sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [{numbers}]\nresolution: [640, 480]\n"
        "camera_model: pinhole\nintrinsics: [520.5, 518.25, 321.0, 242.5]\n"
        "distortion_model: radial-tangential\ndistortion_coefficients: [0.0, 0.0, 0.0, 0.0]\n"
    )
    eye = next(iter(raycam.load_cameras(sensor).values()))
    cameras = raycam.load_cameras(file, intrinsics=eye)
    assert has_notice(cameras.notices, "placed_cameras", "T_BS")
    for i, camera in enumerate(cameras.values()):
        found = world_from_camera(i) @ mount
        check(camera, K, found[:3, :3].T, found[:3, 3])
    assert cameras.times["1403636580838555648"] == pytest.approx(1403636580.838555648, abs=3e-7)
    plain = raycam.load_cameras(file, intrinsics=EYE)
    check_all(plain, 3)
    assert has_notice(plain.notices, "placed_cameras", "IMU", "mount")


def test_trajectory_without_rotations_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "data.csv"
    file.write_text(euroc(4))
    with raises(FormatError, code="syntax", mentions=["leica0"]):
        raycam.load_cameras(file, intrinsics=EYE)


def test_euroc_sequence_folder_is_read_as_a_rig(tmp_path: Path) -> None:
    for i in range(2):
        folder = tmp_path / "mav0" / f"cam{i}"
        folder.mkdir(parents=True)
        numbers = ", ".join(repr(float(v)) for v in world_from_camera(i).ravel())
        (folder / "sensor.yaml").write_text(
            f"T_BS:\n  cols: 4\n  rows: 4\n  data: [{numbers}]\nresolution: [640, 480]\n"
            "intrinsics: [520.5, 518.25, 321.0, 242.5]\ndistortion_model: none\n"
        )
    cameras = raycam.load_cameras(tmp_path)
    check_all(cameras, 2)
    assert list(cameras.rigs["rig"]) == ["cam0", "cam1"]


def test_tum_calibration_next_to_a_trajectory_is_read(tmp_path: Path) -> None:
    R, C = pose(0)
    quaternion = Rotation.from_matrix(R.T).as_quat()
    (tmp_path / "groundtruth.txt").write_text(
        "0.5 " + " ".join(repr(float(v)) for v in [*C, *quaternion]) + "\n"
    )
    (tmp_path / "calibration.txt").write_text("# fx fy cx cy\n520.5 518.25 321.0 242.5\n")
    (tmp_path / "rgb.txt").write_text("0.5 rgb/0.5.png\n")
    picture(tmp_path / "rgb/0.5.png")
    check_all(raycam.load_cameras(tmp_path), 1)
    (camera,) = raycam.load_cameras(tmp_path / "calibration.txt", size=SIZE).values()
    check(camera, K, np.eye(3), np.zeros(3))


NAMED = {f"{i:06d}.png": world_from_camera(i) for i in range(4)}


@pytest.mark.parametrize(
    ("name", "document"),
    [
        ("poses.json", [m.tolist() for m in NAMED.values()]),
        ("poses.json", [m.ravel().tolist() for m in NAMED.values()]),
        ("poses.json", [m[:3].tolist() for m in NAMED.values()]),
        ("poses.json", {name: m.tolist() for name, m in NAMED.items()}),
        ("a.json", {"fps": 30, "poses": [m.tolist() for m in NAMED.values()]}),
        ("a.json", {"w2c": [np.linalg.inv(m).tolist() for m in NAMED.values()]}),
        ("extrinsics.json", [np.linalg.inv(m).tolist() for m in NAMED.values()]),
        ("a.json", [{"file": name, "c2w": m.tolist()} for name, m in NAMED.items()]),
    ],
)
def test_matrices_in_json_are_read(tmp_path: Path, name: str, document: Any) -> None:
    (tmp_path / name).write_text(json.dumps(document, indent=1))
    cameras = raycam.load_cameras(tmp_path / name, intrinsics=EYE)
    check_all(cameras, 4)
    named = "000000.png" in json.dumps(document)
    assert list(cameras) == (list(NAMED) if named else [f"{i:06d}" for i in range(4)])
    assert [notice.code for notice in cameras.notices].count("assumed_convention") == 1
    assert has_notice(cameras.notices, "ignored_key", "fps") == ("fps" in document)


def test_damaged_matrices_in_json_raise(tmp_path: Path) -> None:
    first, second = (world_from_camera(i) for i in range(2))
    file = tmp_path / "poses.json"
    for document, reason in (
        ([first.tolist(), second[:2].tolist()], fault("syntax", "poses.json:1", "[1]")),
        ([first.T.tolist()], fault("syntax", "poses.json:1")),
        ({"c2w": [first.tolist()], "w2c": [second.tolist()]}, fault("syntax", "poses.json:1", "w2c")),
        ([{"c2w": first.tolist(), "dist": [0.1, 0.2, 0, 0]}], fault("syntax", "poses.json:1", "[0].dist")),
    ):
        file.write_text(json.dumps(document))
        with raises(FormatError, **reason):
            raycam.load_cameras(file, format="poses", intrinsics=EYE)
    file.write_text(json.dumps([first.tolist(), (second * np.nan).tolist()]))
    cameras = raycam.load_cameras(file, intrinsics=EYE)
    check_all(cameras, 1)
    assert has_notice(cameras.notices, "ignored_element", 1)


def test_poses_with_only_three_rows_are_read(tmp_path: Path) -> None:
    # The ground truth of ICL-NUIM has three lines and an empty line for each pose.
    file = tmp_path / "livingRoom.gt.sim"
    text = "\n".join(rows(world_from_camera(i)[:3]) for i in range(4))
    for found in (text, text.replace(" ", "; ")):
        file.write_text(found)
        check_all(raycam.load_cameras(file, intrinsics=EYE), 4)
    file.write_text(rows(world_from_camera(0)[:3]))
    check_all(raycam.load_cameras(file, intrinsics=EYE), 1)


def test_poses_in_npz_are_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", poses=np.array(list(NAMED.values())), focal=500.0)
    cameras = raycam.load_cameras(tmp_path / "a.npz", intrinsics=EYE)
    check_all(cameras, 4)
    assert has_notice(cameras.notices, "ignored_key", "focal")


@pytest.mark.parametrize("inner", ["", "pose", "poses"])
@pytest.mark.parametrize("ending", [".npy", ".npz", ".csv", ".json", ".txt"])
def test_folder_with_one_file_per_pose_is_read(tmp_path: Path, ending: str, inner: str) -> None:
    folder = tmp_path / "scene" / inner
    folder.mkdir(parents=True)
    for i in range(12):
        matrix, file = world_from_camera(i), folder / f"frame_{i}{ending}"
        if ending == ".npy":
            np.save(file, matrix[:3] if i % 2 else matrix)
        elif ending == ".npz":
            np.savez_compressed(file, pose=matrix)
        elif ending == ".json":
            file.write_text(json.dumps(matrix.tolist()))
        else:
            file.write_text(rows(matrix).replace(" ", "," if ending == ".csv" else " "))
    picture(tmp_path / "scene/rgb/frame_0.png")
    (tmp_path / "scene/intrinsics.txt").write_text(rows(K))
    cameras = raycam.load_cameras(tmp_path / "scene")
    check_all(cameras, 12)
    assert list(cameras) == [f"frame_{i}" for i in range(12)]
    if inner:
        assert cameras["frame_3"].size == SIZE


def test_damaged_arrays_in_a_folder_raise_with_file_and_key(tmp_path: Path) -> None:
    for i in range(3):
        np.savez(tmp_path / f"{i}.npz", w2c=np.linalg.inv(world_from_camera(i)))
    cameras = raycam.load_cameras(tmp_path, intrinsics=EYE)
    check_all(cameras, 3)
    assert has_notice(cameras.notices, "assumed_convention", "camera_from_world")
    np.savez(tmp_path / "2.npz", c2w=world_from_camera(2))
    with raises(FormatError, code="syntax", mentions=["2.npz"]):
        raycam.load_cameras(tmp_path, intrinsics=EYE)
    np.savez(tmp_path / "2.npz", w2c=np.zeros((3, 3)))
    with raises(FormatError, code="syntax", mentions=["2.npz", "w2c", "[3, 3]"]):
        raycam.load_cameras(tmp_path, intrinsics=EYE)
    np.savez(tmp_path / "2.npz", w2c=np.full((4, 4), -np.inf))
    assert has_notice(raycam.load_cameras(tmp_path, intrinsics=EYE).notices, "ignored_element", "frame 2")


def test_poses_in_archives_of_any_layout_are_read(tmp_path: Path) -> None:
    stack = np.array(list(NAMED.values()))
    file = tmp_path / "a.npz"
    np.savez(file, stack)
    check_all(raycam.load_cameras(file, intrinsics=EYE), 4)
    np.savez(file, **NAMED)
    cameras = raycam.load_cameras(file, intrinsics=EYE)
    check_all(cameras, 4)
    assert list(cameras) == list(NAMED)
    # The file contains more numbers than a text document may contain.
    np.savez(file, poses=np.tile(stack, (1300, 1, 1)), depth=np.zeros((4, 300, 300), np.float32))
    cameras = raycam.load_cameras(file, intrinsics=EYE)
    assert len(cameras) == 5200
    check(cameras["005199"], K, *pose(3))
    assert has_notice(cameras.notices, "ignored_key", "depth")
    np.savez(file, poses=stack, w2c=stack)
    with raises(FormatError, code="syntax", mentions=["w2c"]):
        raycam.load_cameras(file, intrinsics=EYE)
    np.savez(file, poses=stack, dist_coef=np.ones(5))
    with raises(FormatError, code="syntax", mentions=["dist_coef"]):
        raycam.load_cameras(file, format="poses", intrinsics=EYE)
    np.savez(file, poses=np.array([{"a": 1}], dtype=object))
    with raises(FormatError, code="syntax", mentions=["a.npz"]):
        raycam.load_cameras(file, intrinsics=EYE)


@pytest.mark.parametrize("length", [0.0, 0.5, 0.98, 2.0])
def test_quaternions_with_a_length_other_than_1_are_refused(tmp_path: Path, length: float) -> None:
    R, C = pose(1)
    x, y, z, w = length * Rotation.from_matrix(R.T).as_quat()
    c = [float(v) for v in C]
    graph = {
        "T_imu_cam": [dict(zip(("px", "py", "pz", "qx", "qy", "qz", "qw"), [*c, x, y, z, w], strict=True))]
    }
    kinds = {"camera_type": "pinhole", "intrinsics": {"fx": 520.5, "fy": 518.25, "cx": 321.0, "cy": 242.5}}
    files = {
        "a.txt": f"0.5 {' '.join(map(repr, [*c, float(x), float(y), float(z), float(w)]))}\n",
        "a.csv": f"1403636580838555648,{','.join(map(repr, [*c, float(w), float(x), float(y), float(z)]))}\n",
        "a.json": json.dumps({"value0": {**graph, "intrinsics": [kinds], "resolution": [[640, 480]]}}),
        "metadata": json.dumps(
            {"w": 640, "h": 480, "fps": 30, "K": K.T.ravel().tolist(), "poses": [[x, y, z, w, *c]]}
        ),
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
        with raises(FormatError, code="syntax", mentions=[name, f"{length:.4f}"]):
            raycam.load_cameras(tmp_path / name, intrinsics=EYE)


def test_rounded_quaternions_are_normalised(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("0.5 1 2 3 0 0 0.71 0.71\n")
    (camera,) = raycam.load_cameras(tmp_path / "a.txt", intrinsics=EYE).values()
    check(camera, K, Rotation.from_euler("z", -90, degrees=True).as_matrix(), np.array([1.0, 2, 3]))


@pytest.mark.parametrize("count", [12, 16])
@pytest.mark.parametrize("start", [0.5, 1_305_031_102.0])
def test_poses_after_times_are_read(tmp_path: Path, start: float, count: int) -> None:
    poses = [world_from_camera(seed) for seed in range(3)]
    texts = [f"{start + seed!r} " + lines([pose[: count // 4]]) for seed, pose in enumerate(poses)]
    (tmp_path / "a.txt").write_text("# time r11 r12 ...\n" + "".join(texts))
    cameras = raycam.load_cameras(tmp_path / "a.txt", intrinsics=EYE, direction="world_from_camera")
    check_all(cameras, 3)
    assert list(cameras.times.values()) == [start, start + 1, start + 2]
    assert next(iter(cameras)) == repr(start)


def test_poses_after_whole_numbers_stay_kitti_360(tmp_path: Path) -> None:
    texts = [f"{seed} " + lines([world_from_camera(seed)[:3]]) for seed in range(3)]
    (tmp_path / "poses.txt").write_text("".join(texts))
    cameras = raycam.load_cameras(tmp_path / "poses.txt", intrinsics=EYE)
    assert cameras.times == {}
    assert has_notice(cameras.notices, "placed_cameras", "KITTI-360")


@pytest.mark.parametrize("columns", [7, 8])
def test_nuke_chan_is_refused_with_its_missing_values(tmp_path: Path, columns: int) -> None:
    row = ["1", "0", "1.5", "5", "10", "20", "30", "35"][:columns]
    (tmp_path / "a.chan").write_text("\t".join(row) + "\n")
    with raises(FormatError, code="unsupported_feature", mentions=["chan", "order of the rotations", "zxy"]):
        raycam.load_cameras(tmp_path / "a.chan", intrinsics=EYE)
