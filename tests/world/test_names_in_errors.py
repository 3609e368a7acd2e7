"""Errors for wrong keys and names list the names that exist."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import raycam
from raycam import dataset
from support.raises import raises


@pytest.fixture
def world() -> raycam.World:
    made = raycam.World()
    made.add_object(box={"size": 1})
    for name in ("front", "side"):
        made.add_camera(raycam.Camera.look_at([0, -4, 1], [0, 0, 0], size=(8, 6), fov=40), name)
    return made


@pytest.mark.parametrize("key", [0, "frnt", None])
def test_unknown_camera_name_raises_with_all_names(world: raycam.World, key: Any) -> None:
    with pytest.raises(KeyError) as caught:
        world.cameras[key]
    assert "front" in str(caught.value)
    assert "side" in str(caught.value)
    assert world.cameras.get(key) is None


def test_camera_by_number_raises_with_all_names(world: raycam.World) -> None:
    with raises(raycam.WorldError, code="wrong_type", mentions=["0"]):
        world.camera(0)  # type: ignore[arg-type]


@pytest.mark.parametrize("cameras", ["calib.yaml", Path("calib.yaml"), ["front"], {"a": 3}, 5])
def test_data_sets_refuse_objects_that_are_not_cameras(
    world: raycam.World, cameras: Any, tmp_path: Path
) -> None:
    with raises(raycam.SettingsError, code="wrong_type"):
        dataset.write(world, tmp_path / "out", "coco", cameras=cameras)
    assert not (tmp_path / "out").exists()


def test_saving_to_a_device_raises_with_the_alternative(world: raycam.World) -> None:
    frame = raycam.render(world, "front", samples=1, channels="color")
    with raises(raycam.FormatError, code="unknown_format", mentions=["/dev/stdout", "to_png"]):
        frame.save("/dev/stdout")
