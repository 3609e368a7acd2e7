"""Labels compared with images of each object alone, closed forms and NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import raycam
from raycam.annotations.labels import box3d, label
from support.raises import raises
from support.three_lenses import SIZE, cameras


def add_all(world: raycam.World, only: int | None = None) -> None:
    things = [
        {"plane": {"size": [9, 9]}, "name": "floor"},
        {"box": {"size": [1, 1.5, 0.8]}, "location": [0.3, 0.2, 0.4], "yaw": 20, "category": "crate"},
        {"sphere": {"radius": 0.4}, "location": [1.2, -0.4, 0.5], "category": 5},
        {
            "torus": {"radius": 0.6, "tube": 0.15},
            "location": [-2.6, -2.5, 0.6],
            "scale": [1, 2, 1],
            "category": "crate",
        },
        {"box": {"size": 0.2}, "location": [0, 0, -5]},
        {"box": {"size": 1}, "location": [8, -6, 2]},
    ]
    for number, thing in enumerate(things):
        if only in (None, number):
            world.add_object(thing)


def world(only: int | None = None) -> raycam.World:
    made = raycam.World()
    add_all(made, only)
    return made


@pytest.mark.parametrize("name", cameras())
def test_amodal_masks_equal_images_of_each_object_alone(name: str) -> None:
    camera = cameras()[name]
    instance = raycam.render(world(), camera, samples=1, channels="instance")["instance"]
    labels = {item.object: item for item in label(world(), camera)}
    seen = set(np.unique(instance)) - {-1}
    assert seen <= set(labels)
    for number in range(6):
        alone = raycam.render(world(number), camera, samples=1, channels="instance")["instance"] == 0
        if number not in labels:
            assert not alone.any()
            continue
        item = labels[number]
        np.testing.assert_array_equal(item.in_picture(item.amodal_mask), alone)
        np.testing.assert_array_equal(item.in_picture(item.visible_mask), instance == number)
        assert item.visible_pixels == (instance == number).sum()
        assert 0 <= item.visible_fraction <= 1
        if item.visible_box is not None:
            x, y, w, h = item.visible_box
            rows, columns = np.nonzero(instance == number)
            assert (x, y) == (columns.min(), rows.min())
            assert (x + w, y + h) == (columns.max() + 1, rows.max() + 1)
        assert item.amodal_mask.any(axis=0)[[0, -1]].all()
        assert item.amodal_mask.any(axis=1)[[0, -1]].all()


def test_amodal_masks_continue_beyond_the_image_edge() -> None:
    camera = cameras()["pinhole"]
    wide = raycam.Camera(
        camera.K + np.array([[0, 0, SIZE[0]], [0, 0, SIZE[1]], [0, 0, 0]]),
        camera.R,
        camera.C,
        (3 * SIZE[0], 3 * SIZE[1]),
    )
    whole = {item.object: item for item in label(world(), wide, margin=(0, 0))}
    cut = {item.object: item for item in label(world(), camera)}
    assert set(whole) == set(cut)
    for number, item in cut.items():
        x, y, w, h = whole[number].amodal_box
        assert item.amodal_box == (x - SIZE[0], y - SIZE[1], w, h)
        np.testing.assert_array_equal(item.amodal_mask, whole[number].amodal_mask)
    assert any(0 < item.truncated_fraction < 1 for item in cut.values())
    inside = label(world(), camera, margin=(0, 0))
    assert all(item.truncated_fraction == 0 for item in inside)


def test_labels_have_names_and_can_be_limited_to_objects() -> None:
    camera = cameras()["pinhole"]
    labels = label(world(), camera, objects=[2, 1])
    assert [(item.object, item.category, item.category_id) for item in labels] == [
        (2, "5", 5),
        (1, "crate", 1),
    ]
    with raises(raycam.SettingsError, code="out_of_range", mentions=["object", "9", "0", "5"]):
        label(world(), camera, objects=[9])
    with raises(raycam.SettingsError, code="unknown_name", mentions=["'bax'", "'box"]):
        label(world(), camera, objects=["bax"])
    assert [item.object for item in label(world(), camera, objects=[world().objects[1].name])] == [1]
    with raises(raycam.SettingsError, code="wrong_shape", mentions=["[2, 2]", "int32", "[64, 96]"]):
        label(world(), camera, instance=np.zeros((2, 2), np.int32))


def test_box3d_equals_the_placed_box() -> None:
    box = box3d(world(), 1)
    np.testing.assert_allclose(box.size, [1, 1.5, 0.8])
    np.testing.assert_allclose(box.center, [0.3, 0.2, 0.4])
    angle = np.radians(20)
    np.testing.assert_allclose(box.rotation[:, 0], [np.cos(angle), np.sin(angle), 0], atol=1e-12)
    triangles = world().triangles()[world().triangle_ids()[:, 0] == 1].reshape(-1, 3)
    np.testing.assert_allclose(np.unique(box.corners.round(9), axis=0), np.unique(triangles.round(9), axis=0))
    np.testing.assert_allclose(box.corners[6] - box.corners[0], box.rotation @ [0, 1.5, 0.8])
    np.testing.assert_allclose(box3d(world(), 3).size, [1.5, 3, 0.3], rtol=1e-2)
    with raises(raycam.SettingsError, code="out_of_range", mentions=["object", "6", "0", "5"]):
        box3d(world(), 6)


@pytest.mark.parametrize("pane", [{"type": "glass"}, {"opacity": 0.3}], ids=["glass", "opacity"])
def test_ground_truth_uses_the_first_surface_or_the_first_solid_surface(pane: dict[str, Any]) -> None:
    world = raycam.World()
    world.add_object(box={"size": 1}, name="box", category="box")
    world.add_object(box={"size": [0.02, 3, 3]}, name="pane", location=[1.5, 0, 0], category="pane", **pane)
    camera = raycam.Camera.look_at([5, 0, 0], [0, 0, 0], size=(40, 40), fov=30)
    channels = ["instance", "category", "depth", "normal", "material"]
    first = raycam.render(world, camera, samples=1, channels=channels)
    solid = raycam.render(world, camera, samples=1, channels=channels, surface="solid")
    middle = (20, 20)
    assert (first["instance"][middle], solid["instance"][middle]) == (1, 0)
    assert first["depth"][middle] == pytest.approx(5 - 1.51, abs=1e-6)
    assert solid["depth"][middle] == pytest.approx(4.5, abs=1e-6)
    np.testing.assert_allclose(solid["normal"][middle], [1, 0, 0], atol=1e-6)
    assert set(np.unique(solid["instance"])) == {-1, 0}
    labels = {item.name: item for item in raycam.label(world, camera)}
    assert labels["box"].visible_fraction == 0.0  # the pane is in front of the labelled object
    through = raycam.label(world, camera, objects=[0], instance=solid["instance"])
    assert through[0].visible_fraction == 1.0


@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
def test_labels_of_a_rolling_shutter_image_follow_each_line(direction: raycam.camera._optics.Readout) -> None:
    """Each line of the mask equals that line in a mask of the world at the line's time.

    The labelled bar turns and slides during the readout.
    """
    world = raycam.World()
    world.add_object(box={"size": [2, 0.4, 0.2]}, name="bar", location=[0, 0, 5])
    keys = [{"time": 0, "object": "bar", "location": [-0.5, 0, 5], "yaw": 0}]
    keys.append({"time": 1, "object": "bar", "location": [0.5, 0.3, 5], "yaw": 150})
    world.set_video(seconds=1, interpolation="linear", keyframe=keys)
    eye = raycam.Camera([[40, 0, 29.5], [0, 40, 19.5], [0, 0, 1]], np.eye(3), [0, 0, 0], (60, 40))
    camera = eye.exposing(0.1, readout=0.4, direction=direction)
    (item,) = raycam.label(world.at(0.5), camera)
    expected = np.zeros((40, 60), dtype=bool)
    upright = direction in ("down", "up")
    for line in range(40 if upright else 60):
        part = (line + 0.5) / (40 if upright else 60)
        time = 0.5 + 0.4 * ((part if direction in ("down", "right") else 1 - part) - 0.5)
        region = (0, line, 60, 1) if upright else (line, 0, 1, 40)
        seen = raycam.render(world.at(time), eye, samples=1, channels="instance", region=region)["instance"]
        expected[line if upright else slice(None), slice(None) if upright else line] = seen.squeeze() == 0
    np.testing.assert_array_equal(item.in_picture(item.amodal_mask), expected)
    assert item.visible_fraction == 1.0
    standing = raycam.label(world.at(0.5), eye)[0]
    assert (standing.in_picture(standing.amodal_mask) != expected).any()
