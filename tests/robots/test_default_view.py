"""The default camera of robot files with cameras on their links."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.cli import main
from raycam.video import VideoPlan

BOX = "<visual name='v'><geometry><box><size>0.2 0.2 0.4</size></box></geometry></visual>"


def sensor(name: str) -> str:
    image = "<image><width>32</width><height>24</height></image>"
    return f"<sensor name='{name}' type='camera'><camera><horizontal_fov>1</horizontal_fov>{image}</camera></sensor>"


def robot(folder: Path, base: str = "", hand: str = "") -> Path:
    """An SDF file of two links with cameras."""
    path = folder / "arm.sdf"
    path.write_text(
        f"<sdf version='1.9'><model name='arm'><link name='base'>{BOX}{base}</link>"
        f"<link name='hand'><pose>0 0 0.5 0 0 0</pose>{BOX}{hand}</link>"
        "<joint name='turn' type='revolute'><parent>base</parent><child>hand</child><axis><xyz>0 1 0</xyz></axis>"
        "</joint></model></sdf>",
        encoding="utf-8",
    )
    return path


def test_robot_with_a_camera_on_a_link_is_viewed_from_outside(tmp_path: Path) -> None:
    world = raycam.load(robot(tmp_path, hand=sensor("wrist")))
    assert list(world.cameras) == ["arm/wrist"]
    for default in (world.default_camera(), world.copy().default_camera(), world.at(0.0).default_camera()):
        np.testing.assert_array_equal(default.P, world.view_from().P)
    frame = raycam.render(world, channels=["instance"])
    assert set(np.unique(frame["instance"])) == {-1, 0, 1}
    inside = raycam.render(world, "arm/wrist", channels=["depth"])
    assert inside.camera.size == (32, 24)
    np.testing.assert_array_equal(VideoPlan(world).camera.P, world.view_from().P)


def test_camera_of_the_root_link_is_the_default(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    body = '<body name="hand"><geom size="0.1"/><camera name="eye" pos="0 0 0.2"/></body>'
    (tmp_path / "arm.xml").write_text(
        f'<mujoco model="arm"><worldbody>{body}<camera name="side" pos="0 -2 0"/></worldbody></mujoco>',
        encoding="utf-8",
    )
    world = raycam.load(tmp_path / "arm.xml")
    assert set(world.cameras) == {"arm/eye", "arm/side"}
    np.testing.assert_array_equal(world.default_camera().P, world.camera("arm/side").P)


def test_camera_of_a_world_file_is_the_default_also_on_a_link(tmp_path: Path) -> None:
    robot(tmp_path)
    (tmp_path / "room.toml").write_text(
        '[[robot]]\nfile = "arm.sdf"\n[[robot.camera]]\nlink = "hand"\nsize = [8, 6]\nfov = 60\nC = [0, 0, 0.3]\n',
        encoding="utf-8",
    )
    assert raycam.load(tmp_path / "room.toml").default_camera().size == (8, 6)


@pytest.mark.parametrize(
    ("options", "size"),
    [([], (640, 480)), (["--camera", "arm/wrist"], (32, 24)), (["--at", "0"], (640, 480))],
)
def test_command_renders_from_outside_unless_a_camera_is_named(
    tmp_path: Path, options: list[str], size: tuple[int, int]
) -> None:
    path = robot(tmp_path, hand=sensor("wrist"))
    output = tmp_path / "arm.png"
    assert main(["render", str(path), "-o", str(output), "--samples", "1", *options]) == 0
    with Image.open(output) as picture:
        assert picture.size == size
