"""Cameras and rigs are equal if their descriptions are."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
import raycam

LOOKING = raycam.Camera.look_at([3, -4, 2.1], [0, 0, 0.3], size=(64, 48), fov=40)
CAMERA = raycam.Camera(LOOKING.K, LOOKING.R, LOOKING.C, LOOKING.size, distortion=[0.1, -0.02, 0, 0])
KINDS = {"camera": CAMERA, "rig": raycam.Rig.stereo(CAMERA, 0.123)}


def moved(item: raycam.Camera | raycam.Rig) -> raycam.Camera | raycam.Rig:
    """The same object, moved by 1e-9 m."""
    return item.at_pose(item.R, item.C + np.array([1e-9, 0, 0]))


@pytest.mark.parametrize("kind", KINDS)
def test_objects_with_equal_numbers_are_equal(kind: str) -> None:
    item = KINDS[kind]
    again = type(item).from_dict(item.to_dict())
    assert again is not item
    assert again == item
    assert hash(again) == hash(item)
    assert len({item, again}) == 1
    for other in (moved(item), type(item).from_dict(item.to_dict(), up="y"), item.to_dict(), None):
        assert item != other
    assert hash(moved(item)) != hash(item)


def test_cameras_and_rigs_have_different_kinds() -> None:
    assert KINDS["camera"] != KINDS["rig"]


@pytest.mark.parametrize("kind", KINDS)
def test_pickles_and_copies_are_equal(kind: str) -> None:
    item = type(KINDS[kind]).from_dict(KINDS[kind].to_dict(), up="y")
    for again in (pickle.loads(pickle.dumps(item)), copy.copy(item), copy.deepcopy(item)):
        assert type(again) is type(item)
        assert again == item
        assert again.up == "y"


def test_user_subclass_pickles_as_itself() -> None:
    mine = Mine.from_dict(CAMERA.to_dict())
    assert type(pickle.loads(pickle.dumps(mine))) is Mine
    assert mine == CAMERA
    assert hash(CAMERA) == hash(mine)
    assert CAMERA.__eq__(mine) is True


class Mine(raycam.Camera):
    """A user's subclass of Camera."""
