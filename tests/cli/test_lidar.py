"""The commands `raycam scan` and `raycam lidars`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.cli import main

STREET = """
[[object]]
name = "road"
plane = { size = [60, 60] }
color = [0.5, 0.5, 0.5]

[[object]]
name = "car"
box = { size = [4, 2, 1.5] }
location = [10, 0, 0.75]
color = [0.5, 0.5, 0.5]

[video]
seconds = 1

[[video.keyframe]]
time = 0
object = "car"
location = [10, 0, 0.75]

[[video.keyframe]]
time = 1
object = "car"
location = [14, 0, 0.75]
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "street.toml").write_text(STREET, encoding="utf-8")
    monkeypatch.chdir(tmp_path)


def test_scan_writes_the_points_of_the_python_call(capsys: pytest.CaptureFixture[str]) -> None:
    options = [
        "--location",
        "0",
        "0",
        "1.8",
        "--yaw",
        "20",
        "--at",
        "0.5",
        "--returns",
        "last",
        "--rate",
        "20",
    ]
    assert main(["scan", "street.toml", "--lidar", "vlp16", "-o", "a.npz", *options]) == 0
    lidar = raycam.Lidar("vlp16", rate=20, returns="last").placed([0, 0, 1.8], yaw=20)
    expected = raycam.scan(raycam.load("street.toml").at(0.5), lidar)
    with np.load("a.npz") as arrays:
        for name in expected:
            np.testing.assert_array_equal(arrays[name], expected[name])
    assert f"a.npz: {expected.count} points" in capsys.readouterr().out


def test_scan_writes_the_requested_fields_in_world_coordinates() -> None:
    command = [
        "scan",
        "street.toml",
        "--lidar",
        "vlp16",
        "--location",
        "0",
        "0",
        "1.8",
        "--at",
        "0",
        "--no-noise",
    ]
    assert main([*command, "-o", "a.csv", "--fields", "ring", "instance", "--in-world"]) == 0
    table = np.genfromtxt("a.csv", delimiter=",", names=True)
    assert table.dtype.names == ("x", "y", "z", "ring", "instance")
    np.testing.assert_allclose(table["z"][table["instance"] == 0], 0, atol=1e-9)


@pytest.mark.parametrize(
    ("options", "facts"),
    [
        (["--lidar", "vlp61"], ["vlp61", "vlp16", "raycam lidars"]),
        (["--lidar", "missing.json"], ["missing.json"]),
        (["--lidar", "vlp16", "--rate", "50"], ["50", "5 to 20", "--force-rate"]),
        (["--lidar", "vlp16", "-o", "a.xyz"], [".xyz", ".pcd"]),
        (["--lidar", "vlp16", "--animation", "walk"], ["--at"]),
        (["--lidar", "vlp16", "--fields", "rings"], ["rings", "ring"]),
    ],
)
def test_impossible_scans_are_refused(
    options: list[str], facts: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["scan", "street.toml", "--location", "0", "0", "1", *options]) != 0
    text = capsys.readouterr().err
    for fact in facts:
        assert fact in text


WITH_LIDARS = (
    STREET
    + """
[[lidar]]
name = "pole"
device = "vlp16"
location = [0, 0, 3]
noise = false
[[rig]]
name = "car"
[[rig.lidar]]
name = "top"
device = "hdl32e"
location = [0, 0, 1.8]
"""
)


def test_force_rate_scans_at_a_rate_that_the_device_does_not_support() -> None:
    command = ["scan", "street.toml", "--lidar", "vlp16", "--at", "0", "--location", "0", "0", "1.8"]
    assert main([*command, "--rate", "50", "--force-rate", "-o", "a.npz"]) == 0
    lidar = raycam.Lidar("vlp16", rate=50, force_rate=True).placed([0, 0, 1.8])
    expected = raycam.scan(raycam.load("street.toml").at(0), lidar)
    with np.load("a.npz") as arrays:
        np.testing.assert_array_equal(arrays["position"], expected["position"])


@pytest.mark.parametrize("name", ["car/tpo", "poel"])
def test_unknown_lidar_error_lists_the_lidars_of_the_world_and_the_devices(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("both.toml").write_text(WITH_LIDARS, encoding="utf-8")
    assert main(["scan", "both.toml", "--lidar", name]) != 0
    text = capsys.readouterr().err
    for expected in (repr(name), "car/top", "pole", "vlp16"):
        assert expected in text


def test_scan_uses_the_lidars_of_the_world_file(capsys: pytest.CaptureFixture[str]) -> None:
    Path("both.toml").write_text(WITH_LIDARS, encoding="utf-8")
    assert main(["scan", "both.toml", "--lidar", "pole", "--at", "0.5", "-o", "a.npz"]) == 0
    expected = raycam.scan(raycam.load("both.toml").at(0.5), "pole")
    with np.load("a.npz") as arrays:
        np.testing.assert_array_equal(arrays["position"], expected["position"])
    assert (
        main(
            [
                "scan",
                "both.toml",
                "--lidar",
                "pole",
                "--at",
                "0.5",
                "-o",
                "b.npz",
                "--location",
                "0",
                "0",
                "1",
            ]
        )
        == 0
    )
    with np.load("b.npz") as arrays:
        assert arrays["position"][:, 2].min() > expected["position"][:, 2].min()
    assert main(["scan", "both.toml", "--lidar", "car/top", "--at", "0", "-o", "c.npz"]) == 0
    assert main(["scan", "both.toml", "--lidar", "top", "--at", "0", "-o", "f.npz"]) == 0
    assert Path("c.npz").read_bytes() == Path("f.npz").read_bytes()
    capsys.readouterr()
    for world, facts in (("both.toml", ["pole", "car/top", "--lidar"]), ("street.toml", ["--lidar"])):
        assert main(["scan", world, "-o", "d.npz"]) == 2
        text = capsys.readouterr().err
        assert all(fact in text for fact in facts)
    Path("one.toml").write_text(WITH_LIDARS.partition("[[rig]]")[0], encoding="utf-8")
    assert main(["scan", "one.toml", "--at", "0.5", "-o", "e.pcd", "--text"]) == 0
    assert b"DATA ascii" in Path("e.pcd").read_bytes()


def test_notices_of_a_scan_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(["scan", "street.toml", "--lidar", "pandar64", "--location", "0", "0", "1", "-o", "a.pcd"]) == 0
    )
    text = capsys.readouterr().err
    assert "generic angles" in text
    assert "world.at" in text or "--at" in text


def test_lidars_are_listed_and_described(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lidars"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == raycam.lidar.device_names()
    assert main(["lidars", "os1-64"]) == 0
    assert "range_10: 40 metres" in capsys.readouterr().out


RIG = """
[[rig]]
name = "car"

[[rig.camera]]
name = "CAM_FRONT"
size = [40, 30]
fov = 60
location = [0.5, 0, 1.2]
"""


def test_dataset_mounts_lidars_on_the_rig(tmp_path: Path) -> None:
    Path("car.toml").write_text(STREET.replace("[video]", RIG + "\n[video]"), encoding="utf-8")
    command = ["dataset", "car.toml", "-o", "out", "--rig", "car", "--format", "nuscenes", "--samples", "1"]
    Path("body.tum").write_text("0 0 0 0 0 0 0 1\n0.1 1 0 0 0 0 0 1\n", encoding="utf-8")
    assert main([*command, "--lidar", "LIDAR_TOP=vlp16@0,0,1.8", "--poses", "body.tum"]) == 0
    scans = sorted(Path("out/samples/LIDAR_TOP").iterdir())
    assert len(scans) == 2
    points = np.fromfile(scans[0], np.float32).reshape(-1, 5)
    assert points[:, 2].min() == pytest.approx(-1.8, abs=0.2)


@pytest.mark.parametrize(
    "text", ["vlp16", "top=vlp16", "top=vlp16@0,0", "=vlp16@0,0,1", "CAM_FRONT=vlp16@0,0,1"]
)
def test_malformed_mounts_are_refused(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("car.toml").write_text(STREET + RIG, encoding="utf-8")
    command = ["dataset", "car.toml", "-o", "out", "--rig", "car", "--format", "nuscenes"]
    assert main([*command, "--lidar", text]) == 2
    assert text in capsys.readouterr().err
