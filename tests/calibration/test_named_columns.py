"""Trajectories whose header determines the order of the numbers, compared with SciPy."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.errors import FormatError
from scipy.spatial.transform import Rotation
from support.raises import raises

ROTATIONS = Rotation.random(4, random_state=1)
X, Y, Z, W = ROTATIONS.as_quat().T
PLACES = np.random.default_rng(1).uniform(-3, 3, (4, 3))
VALUES = dict(
    zip(
        ["tx", "ty", "tz", "qx", "qy", "qz", "qw", "scale", "quality", "v"],
        [*PLACES.T, X, Y, Z, W, np.full(4, 0.5), np.ones(4), np.zeros(4)],
        strict=True,
    )
)
STAMP = 1_600_000_000_000_000_000


def check(path: Path) -> raycam.Cameras:
    camera = raycam.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], np.eye(3), np.zeros(3), (640, 480))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cameras = raycam.load_cameras(path, intrinsics=camera)
    for read, R, C in zip(cameras.values(), ROTATIONS.as_matrix(), PLACES, strict=True):
        np.testing.assert_allclose(read.R.T, R, atol=1e-7)
        np.testing.assert_allclose(read.C, C, atol=1e-7)
    return cameras


@pytest.mark.parametrize(
    ("header", "columns", "comma"),
    [
        ("# timestamp tx ty tz qx qy qz qw", "tx ty tz qx qy qz qw", False),
        ("# timestamp tx ty tz qw qx qy qz", "tx ty tz qw qx qy qz", False),
        ("#time x y z q_w q_x q_y q_z", "tx ty tz qw qx qy qz", False),
        ("timestamp,qx,qy,qz,qw,tx,ty,tz", "qx qy qz qw tx ty tz", True),
        ("timestamp,x,y,z,w,x,y,z", "tx ty tz qw qx qy qz", True),
        ("#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []",
         "tx ty tz qw qx qy qz", True),
        ("#timestamp [ns], p_x, p_y, p_z, q_x, q_y, q_z, q_w", "tx ty tz qx qy qz qw", True),
        ("# frame_id, translation (x, y, z), rotation quaternion (qx, qy, qz, qw), scale, fusion_quality, v3",
         "tx ty tz qx qy qz qw scale quality v", True),
        ("# timestamp, position.x, position.y, position.z, orientation.x, orientation.y, orientation.z, "
         "orientation.w, scale", "tx ty tz qx qy qz qw scale", True),
        ("# t[s] north east down qw qx qy qz", "tx ty tz qw qx qy qz", False),
        ("# format: timestamp tx ty tz qw qx qy qz", "tx ty tz qw qx qy qz", False),
        ("# TUM format timestamp tx ty tz qx qy qz qw (camera to world)", "tx ty tz qx qy qz qw", False),
        ("timestamp;tx;ty;tz;qw;qx;qy;qz", "tx ty tz qw qx qy qz", False),
        ("# time (s) | x (m) | y (m) | z (m) | qw | qx | qy | qz", "tx ty tz qw qx qy qz", False),
        ("timestamp(ns) translation(x y z) quaternion(w x y z)", "tx ty tz qw qx qy qz", False),
        ("secs tx ty tz rw rx ry rz", "tx ty tz qw qx qy qz", False),
        ("# timestamp x y z w i j k", "tx ty tz qw qx qy qz", False),
        ("t,cam_x,cam_y,cam_z,cam_qw,cam_qx,cam_qy,cam_qz", "tx ty tz qw qx qy qz", True),
        ('"timestamp","tx","ty","tz","qw","qx","qy","qz"', "tx ty tz qw qx qy qz", True),
        ("\ufeff# timestamp tx ty tz qw qx qy qz", "tx ty tz qw qx qy qz", False),
    ],
)  # fmt: skip
def test_column_names_determine_the_order(tmp_path: Path, header: str, columns: str, comma: bool) -> None:
    joint = ", " if comma else " "
    lines = [header]
    for i in range(4):
        values = [repr(float(VALUES[name][i])) for name in columns.split()]
        lines.append(joint.join([str(STAMP + i * 50_000_000), *values]))
    (tmp_path / "poses.txt").write_text("\n".join(lines) + "\n")
    check(tmp_path / "poses.txt")


@pytest.mark.parametrize(
    ("prose", "columns"),
    [
        ("Each line: timestamp, position, and the orientation as a quaternion (w, x, y, z)", "tx ty tz qw qx qy qz"),
        ("time, translation, rotation quaternion (scalar first)", "tx ty tz qw qx qy qz"),
        ("Quaternions are scalar-last", "tx ty tz qx qy qz qw"),
        ("positions in metres; quaternion order is wxyz", "tx ty tz qw qx qy qz"),
        ("time, quaternion with w first, then the position", "qw qx qy qz tx ty tz"),
    ],
)  # fmt: skip
@pytest.mark.parametrize(("separator", "mark"), [(" ", "#"), (",", "%")])
def test_order_stated_in_prose_determines_the_order(
    tmp_path: Path, prose: str, columns: str, separator: str, mark: str
) -> None:
    lines = [f"{mark} recorded in the laboratory", f"{mark} {prose}"]
    for i in range(4):
        values = [repr(float(VALUES[name][i])) for name in columns.split()]
        lines.append(separator.join([str(STAMP + i), *values]))
    (tmp_path / "poses.txt").write_text("\r\n".join(lines))
    check(tmp_path / "poses.txt")


def test_comments_that_state_both_orders_are_refused(tmp_path: Path) -> None:
    text = "# quaternion w x y z\n# scalar last\n1 1 2 3 0 0 0 1\n"
    (tmp_path / "poses.txt").write_text(text)
    with raises(FormatError, code="syntax"):
        raycam.load_cameras(tmp_path / "poses.txt")


def test_row_of_another_length_below_prose_is_compared_with_the_first_row(tmp_path: Path) -> None:
    text = "# quaternion w x y z\n1 1 2 3 1 0 0 0\n2 1 2 3 1 0 0\n"
    (tmp_path / "poses.txt").write_text(text)
    with raises(FormatError, code="syntax", mentions=["poses.txt:3", "first row", "8"]):
        raycam.load_cameras(tmp_path / "poses.txt")


@pytest.mark.parametrize(("name", "is_reported"), [("{}_mm", True), ("{} [cm]", True), ("{} [m]", False)])
def test_unit_of_positions_in_a_header_is_reported(tmp_path: Path, name: str, is_reported: bool) -> None:
    header = ",".join(["time", *(name.format(axis) for axis in "xyz"), "qw", "qx", "qy", "qz"])
    (tmp_path / "poses.csv").write_text(f"{header}\n1.5,10,20,30,1,0,0,0\n2.5,10,20,30,1,0,0,0\n")
    camera = raycam.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], np.eye(3), np.zeros(3), (640, 480))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cameras = raycam.load_cameras(tmp_path / "poses.csv", intrinsics=camera)
    np.testing.assert_array_equal(next(iter(cameras.values())).C, [10, 20, 30])
    assert [notice.code for notice in cameras.notices] == ["placed_cameras"] * is_reported


def test_gnss_poses_of_4seasons_have_w_last(tmp_path: Path) -> None:
    rows = [
        [STAMP + i, *PLACES[i], X[i], Y[i], Z[i], W[i], 0.5, 1.0, 0.0]
        for i in range(4)
    ]  # fmt: skip
    text = "\n".join(",".join(map(repr, [row[0], *map(float, row[1:])])) for row in rows)
    (tmp_path / "GNSSPoses.txt").write_text(text)
    check(tmp_path / "GNSSPoses.txt")
    (tmp_path / "other.txt").write_text(text)
    with raises(FormatError, code="syntax", mentions=["other.txt:1"]):
        raycam.load_cameras(tmp_path / "other.txt")


@pytest.mark.parametrize(
    "header",
    [
        "# timestamp tx ty tz qx qy qz",
        "# timestamp id tx ty tz qx qy qz qw",
        "# t x y z qx qx qz qw",
        "# timestamp tx ty tz q0 q1 q2 q3",
    ],
)
def test_headers_that_contradict_the_rows_are_refused(tmp_path: Path, header: str) -> None:
    (tmp_path / "poses.txt").write_text(f"{header}\n1.0 1 2 3 0 0 0 1\n2.0 1 2 3 0 0 0 1\n")
    with raises(FormatError, code="syntax", mentions=["poses.txt"]):
        raycam.load_cameras(tmp_path / "poses.txt")


def test_semicolons_separate_columns_of_rows_too(tmp_path: Path) -> None:
    names = ["qw", "qx", "qy", "qz", "tx", "ty", "tz"]
    rows = [";".join([str(i), *(repr(float(VALUES[name][i])) for name in names)]) for i in range(4)]
    (tmp_path / "a.csv").write_text("\r\n".join([";".join(["time", *names]), *rows]))
    check(tmp_path / "a.csv")


def test_seconds_and_nanoseconds_in_two_columns_are_one_time(tmp_path: Path) -> None:
    head = "header.stamp.sec,header.stamp.nanosec,"
    names = "position.x,position.y,position.z,orientation.x,orientation.y,orientation.z,orientation.w"
    rows = [f"1600000000,{nanoseconds},1,2,3,0,0,0,1" for nanoseconds in (5, 500_000_000)]
    (tmp_path / "a.csv").write_text("\n".join([head + names, *rows]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cameras = raycam.load_cameras(tmp_path / "a.csv")
    assert cameras.times == {
        "1600000000.000000005": 1_600_000_000.000000005,
        "1600000000.500000000": 1_600_000_000.5,
    }


def test_times_keep_their_unit(tmp_path: Path) -> None:
    names = ["tx", "ty", "tz", "qx", "qy", "qz", "qw"]
    row = ",".join(repr(float(VALUES[name][0])) for name in names)
    for stamp, unit in [("1600000000000000", "us"), ("1600000000000000000", "ns"), ("1600000000.0", "s")]:
        (tmp_path / "a.csv").write_text(f"timestamp [{unit}],{','.join(names)}\n{stamp},{row}\n")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            cameras = raycam.load_cameras(tmp_path / "a.csv")
        assert list(cameras.times.values()) == [1.6e9]


def written(path: Path, header: str, rows: list[list[float]], comma: str = " ") -> Path:
    path.write_text(
        "\n".join(
            [
                header,
                *(
                    comma.join(repr(value if isinstance(value, int) else float(value)) for value in row)
                    for row in rows
                ),
            ]
        )
        + "\n"
    )
    return path


def test_header_may_name_more_columns_than_the_rows_have(tmp_path: Path) -> None:
    # The sequences of UZH-FPV name a covariance in their headers that the rows do not contain.
    header = "# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12 Pt33"
    rows = [[float(i), *PLACES[i], X[i], Y[i], Z[i], W[i]] for i in range(4)]
    cameras = check(written(tmp_path / "poses.txt", header, rows))
    assert [notice.code for notice in cameras.notices] == ["missing_value"]
    rows[2].append(0.5)
    with raises(FormatError, code="syntax", mentions=[":4", "9", "8"]):
        raycam.load_cameras(written(tmp_path / "uneven.txt", header, rows))
    # A row without its first value is not a pose: the last number of its quaternion is missing.
    with raises(FormatError, code="syntax", mentions=[":2", "7", "11"]):
        raycam.load_cameras(written(tmp_path / "short.txt", header, [row[1:8] for row in rows]))
    # If a row lacks a value before its pose and has one value more after the pose, its columns are shifted.
    shifted = [[*row[1:8], 2.0, 0.1] for row in rows]
    with raises(FormatError, code="syntax", mentions=["length"]):
        raycam.load_cameras(written(tmp_path / "shifted.txt", header, shifted))


@pytest.mark.parametrize("scale", [3.4, 0.02, -1.0])
def test_quaternions_of_any_length_in_named_columns_are_normalized(tmp_path: Path, scale: float) -> None:
    header = "# timestamp, camera_id, qw, qx, qy, qz, tx, ty, tz"
    quaternions = scale * np.stack([W, X, Y, Z], 1)
    rows = [[float(i), 0.0, *quaternions[i], *PLACES[i]] for i in range(4)]
    cameras = check(written(tmp_path / "poses.txt", header, rows, ", "))
    codes = [notice.code for notice in cameras.notices]
    assert ("implausible" in codes) == (scale != -1.0)
    rows[1][2:6] = [0.0] * 4
    with raises(FormatError, code="syntax", mentions=[":3"]):
        raycam.load_cameras(written(tmp_path / "zero.txt", header, rows, ", "))


def test_times_of_euroc_are_nanoseconds_even_if_they_are_short(tmp_path: Path) -> None:
    names = "p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []"
    others = ", ".join(f"v_RS_R_{axis} [m s^-1]" for axis in "xyzabcdef")
    rows = [[251_410_000_000 + i, *PLACES[i], W[i], X[i], Y[i], Z[i], *[0.0] * 9] for i in range(4)]
    cameras = check(written(tmp_path / "data.csv", f"#timestamp, {names}, {others}", rows, ","))
    assert list(cameras.times.values()) == pytest.approx([251.41 + i * 1e-9 for i in range(4)], abs=1e-12)


def test_groups_in_a_row_above_the_names_determine_the_columns(tmp_path: Path) -> None:
    """The header of OptiTrack's Motive, whose rotation precedes the position."""
    path = tmp_path / "take.csv"
    groups = [
        ",,Rigid Body,Rigid Body",
        ",,camera,camera",
        ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position",
    ]
    lines = ["Format Version,1.23,Take Name,a", "", *groups, "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z"]
    lines += [",".join(map(str, [i, i / 120, X[i], Y[i], Z[i], W[i], *PLACES[i]])) for i in range(4)]
    path.write_text("\n".join(lines) + "\n")
    assert list(check(path).times.values()) == pytest.approx([i / 120 for i in range(4)])


def test_letters_of_a_quaternion_before_the_position_are_refused(tmp_path: Path) -> None:
    rows = [[float(i), X[i], Y[i], Z[i], W[i], *PLACES[i]] for i in range(4)]
    path = written(tmp_path / "poses.csv", "timestamp,x,y,z,w,x,y,z", rows, ",")
    with raises(FormatError, mentions=["length"]):
        raycam.load_cameras(path)


def test_time_before_a_matrix_is_reported(tmp_path: Path) -> None:
    matrix = np.column_stack([np.eye(3), [1, 2, 3]]).ravel()
    path = tmp_path / "global_pose.csv"
    path.write_text(f"1561000444355750404,{','.join(map(str, matrix))}\n")
    with raises(FormatError, mentions=["3x4", "time", "kitti-poses"]):
        raycam.load_cameras(path)


def test_array_of_pose_columns_is_refused_with_the_call_that_writes_a_text(tmp_path: Path) -> None:
    np.save(tmp_path / "poses.npy", np.column_stack([PLACES, X, Y, Z, W]))
    with raises(FormatError, mentions=["7 columns", "np.savetxt", "qx qy qz qw"]):
        raycam.load_cameras(tmp_path / "poses.npy")


@pytest.mark.parametrize("micro", ["\u00b5", "\u03bc"])
def test_both_micro_signs_are_read_as_micrometres(tmp_path: Path, micro: str) -> None:
    path = tmp_path / "poses.csv"
    header = ["t", *(f"{axis} [{micro}m]" for axis in "xyz"), "qx", "qy", "qz", "qw", micro]
    row = [STAMP, *(1e6 * PLACES[0]), X[0], Y[0], Z[0], W[0], 5]
    path.write_text(",".join(header) + "\n" + ",".join(map(str, row)) + "\n", encoding="utf-8")
    camera = raycam.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], np.eye(3), np.zeros(3), (640, 480))
    with pytest.warns(raycam.Notice, match="positions in \u00b5m; they are not converted"):
        [found] = raycam.load_cameras(path, intrinsics=camera).values()
    np.testing.assert_allclose(found.C, 1e6 * PLACES[0], rtol=1e-9)
