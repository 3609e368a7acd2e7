"""Arrays and tables of cameras, rigs and worlds are read-only.

Errors name the method that makes the change.
"""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import raycam
from support.raises import raises

K = [[100.0, 0, 32], [0, 100, 24], [0, 0, 1]]


def camera() -> raycam.Camera:
    lens = raycam.Camera(K, np.eye(3), [0, 0, 3], (64, 48), distortion=[0.1, 0, 0, 0])
    return lens.with_aperture(0.01, focus=2.0).with_vignetting(cos4=True).exposing(0.1)


def rig() -> raycam.Rig:
    return raycam.Rig.stereo(raycam.Camera(K, np.eye(3), [0, 0, 3], (64, 48)), 0.2)


def world() -> raycam.World:
    world = raycam.World()
    world.add_object("box", name="box")
    return world


CAMERA = "K R C center location t P distortion forward roll_pitch_yaw"
ARRAYS: dict[str, tuple[Callable[[], Any], str, type[Exception]]] = {
    **{f"camera.{name}": (camera, name, raycam.CameraError) for name in CAMERA.split()},
    "rig.R": (rig, "R", raycam.CameraError),
    "rig.C": (rig, "C", raycam.CameraError),
    "world.bounds": (world, "bounds", raycam.WorldError),
}
CHANGES: dict[str, Callable[[Any], object]] = {
    "an element": lambda array: array.__setitem__(0, 9),
    "all": lambda array: array.__setitem__(..., 9),
    "an element of a view": lambda array: array[...].__setitem__(0, 9),
    "addition": lambda array: array.__iadd__(1),
    "subtraction": lambda array: array.__isub__(1),
    "multiplication": lambda array: array.__imul__(2),
    "division": lambda array: array.__itruediv__(2),
    "fill": lambda array: array.fill(1),
    "sort": lambda array: array.sort(),
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("name", ARRAYS)
def test_changing_an_array_of_a_property_raises(name: str, change: str) -> None:
    make, attribute, error = ARRAYS[name]
    owner = make()
    before = np.array(getattr(owner, attribute))
    with raises(error, code="read_only"):
        CHANGES[change](getattr(owner, attribute))
    np.testing.assert_array_equal(getattr(owner, attribute), before)


@pytest.mark.parametrize("name", ["aperture", "vignetting", "shutter"])
def test_changing_a_table_of_a_camera_raises(name: str) -> None:
    table = getattr(camera(), name)
    with raises(raycam.CameraError, code="read_only"):
        table[next(iter(table))] = 0.5
    assert copy.copy(table) == dict(table)


@pytest.mark.parametrize("name", ["rigs", "categories", "counts", "render_settings", "cameras"])
def test_changing_a_table_of_a_world_raises(name: str) -> None:
    table = getattr(world(), name)
    with raises(raycam.WorldError, code="read_only", mentions=["world"]):
        table["new"] = 1


def test_changing_a_table_of_a_rig_raises() -> None:
    with raises(raycam.CameraError, code="read_only", mentions=["Rig"]):
        rig().mounts["left"] = camera()
    moving = rig().moving(rig().placed([1, 0, 0]), exposure=0.1)
    assert moving.shutter is not None
    with raises(raycam.CameraError, code="read_only", mentions=["moving"]):
        moving.shutter["exposure"] = 3


def test_results_of_calculations_and_copies_can_be_changed() -> None:
    k = camera().K
    assert repr(k) == repr(np.array(K))
    for result in (
        k + 0,
        k @ np.eye(3),
        k.copy(),
        np.array(k),
        copy.copy(k),
        copy.deepcopy(k),
        np.linalg.inv(k),
    ):
        assert type(result) is np.ndarray
        result[0, 2] += 10
        assert result.flags.writeable
    assert isinstance(k.sum(), np.float64)
    restored = pickle.loads(pickle.dumps(k))
    assert type(restored) is np.ndarray
    np.testing.assert_array_equal(restored, K)
