"""Robots on the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.cli import main
from raycam.world.joint_keyframes import read_trajectory
from robots.conftest import ARM
from support.raises import fault, raises


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder with the arm, as the current folder."""
    (tmp_path / "arm.urdf").write_text(ARM, encoding="utf-8")
    monkeypatch.chdir(tmp_path)


def test_joints_option_sets_joints() -> None:
    options = ["--size", "40x30", "--channels", "depth"]
    assert main(["render", "arm.urdf", "--joints", "turn=1", "arm/push=0.2", "-o", "a.npz", *options]) == 0
    world = raycam.load("arm.urdf")
    camera = world.view_from(size=(40, 30))
    world.set_joints("arm", {"turn": 1, "push": 0.2})
    expected = raycam.render(world, world.view_from(size=(40, 30)), channels=["depth"])["depth"]
    assert camera.C.any()
    np.testing.assert_array_equal(np.load("a.npz")["depth"], expected)


@pytest.mark.parametrize(
    ("text", "expected"), [("trun=1", "turn"), ("turn=a", "number"), ("x/turn=1", "arm")]
)
def test_wrong_joints_are_refused(text: str, expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", "arm.urdf", "--joints", text, "-o", "a.npz"]) != 0
    assert expected in capsys.readouterr().err


def test_info_shows_joints_and_links(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "arm.urdf"]) == 0
    text = capsys.readouterr().out
    for line in ("joint 'turn': revolute, -1 to 2", "    link upper", "        link finger"):
        assert line in text


@pytest.mark.parametrize(
    ("document", "joint"),
    [
        (ARM, "joint 'turn'"),
        (
            '<?xml version="1.0"?><!-- <opencv_storage> --><mujoco><worldbody><body><joint name="roll"/>'
            '<geom size="1"/></body></worldbody></mujoco>',
            "joint 'roll'",
        ),
    ],
)
def test_info_of_an_xml_file_shows_its_robot(
    document: str, joint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("robot.xml").write_text(document, encoding="utf-8")
    assert main(["info", "robot.xml"]) == 0
    assert joint in capsys.readouterr().out


def test_info_of_an_xml_file_with_an_entity_reports_the_entity(capsys: pytest.CaptureFixture[str]) -> None:
    Path("robot.xml").write_text(
        '<!DOCTYPE r [<!ENTITY laugh "m">]><mujoco model="&laugh;"/>', encoding="utf-8"
    )
    assert main(["info", "robot.xml"]) != 0
    assert "'laugh'" in capsys.readouterr().err


def test_trajectory_moves_the_robot_in_a_video() -> None:
    Path("j.csv").write_text("time, turn\n0, 0\n0.5, 1\n", encoding="utf-8")
    command = ["video", "arm.urdf", "--trajectory", "j.csv", "-o", "v.gif", "--fps", "4", "--size", "32x24"]
    assert main([*command, "--samples", "1"]) == 0
    assert Path("v.gif").stat().st_size > 0


def test_trajectories_are_read_from_csv_and_npy() -> None:
    robot = raycam.load("arm.urdf").robots["arm"]
    Path("j.csv").write_text("time,push\n0,0.1\n1,0.2\n", encoding="utf-8-sig")  # as written by Excel
    times, vectors = read_trajectory(robot, "j.csv")
    np.testing.assert_array_equal(times, [0, 1])
    np.testing.assert_array_equal(vectors, [[0, 0.1], [0, 0.2]])
    np.save("j.npy", np.array([[0, 0.5, 0.1], [1, 0.6, 0.2]]))
    np.testing.assert_array_equal(read_trajectory(robot, "j.npy")[1], [[0.5, 0.1], [0.6, 0.2]])
    for text, expected in (
        ("a,b\n", fault("missing_value", "j.csv:1", '"time, JOINT, ..."')),
        ("time,turn\n0,x\n", fault("wrong_shape", "j.csv:2")),
        ("time,trun\n0,1\n", fault("unknown_name", "'turn'")),
    ):
        Path("j.csv").write_text(text, encoding="utf-8")
        with raises(raycam.WorldError, **expected):
            read_trajectory(robot, "j.csv")
