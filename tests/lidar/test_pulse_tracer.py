"""Blocks of pulses, and reflectances of textures."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from lidar.conftest import GREY
from raycam.lidar import pulse_tracer
from raycam.notices import collected


def street() -> raycam.World:
    """A moving box behind glass, next to a mirror, a translucent net and a sign of reflective sheeting."""
    world = raycam.World()
    world.add_object(plane={"size": [60, 60]}, name="floor", color=[0.6, 0.3, 0.2])
    world.add_object(box={"size": [0.1, 6, 4]}, name="pane", location=[5, 0, 1], type="glass")
    world.add_object(box={"size": [1, 2, 2]}, name="car", location=[9, 0, 1], color=GREY)
    mirror = {"type": "metal", "metal": "silver", "roughness": 0}
    world.add_object(box={"size": [0.1, 4, 4]}, name="mirror", location=[-6, 0, 1], **mirror)
    world.add_object(box={"size": [0.1, 3, 3]}, name="net", location=[3, -4, 1], opacity=0.4)
    world.add_object(box={"size": [1, 1, 1]}, name="sign", location=[0, 6, 1], lidar={"retroreflection": 9})
    keys = [{"time": t, "object": "car", "location": [9, 4 * t, 1]} for t in (0, 1)]
    world.set_video(seconds=1, keyframe=keys)
    return world


@pytest.mark.parametrize(
    "settings",
    [{"max_range": 8.0}, {"beam_samples": 7, "returns": "all", "waveform": True, "visibility": 80.0}],
)
def test_scans_do_not_depend_on_the_size_of_blocks(
    monkeypatch: pytest.MonkeyPatch, settings: dict[str, object]
) -> None:
    world = street().at(0.2)
    lidar = raycam.Lidar("os1-16", mode="512x10", near_ir_samples=1, **settings)
    start = lidar.placed([0, 0, 1.8])
    moving = start.moving(start.placed([1, 0, 1.8], yaw=10))
    with collected() as before:
        whole = raycam.scan(world, moving, frame=2, keep_lost=True)
    monkeypatch.setattr(pulse_tracer, "RAYS_PER_BLOCK", 1000)
    with collected() as after:
        parts = raycam.scan(world, moving, frame=2, keep_lost=True)
    assert [notice.code for notice in before] == [notice.code for notice in after]
    assert set(whole) == set(parts)
    assert ("visibility" in settings) != (len(np.unique(whole["lost"])) > 2)
    for name in whole:
        assert whole[name].tobytes() == parts[name].tobytes(), name


def sign(image: object, **keys: object) -> raycam.World:
    """A square that faces the beams, with a texture of reflectances."""
    world = raycam.World()
    corners = [[10.0, 1, -1], [10, -1, -1], [10, -1, 1], [10, 1, 1]]
    world.add_mesh(
        corners,
        [[0, 2, 1], [0, 3, 2]],
        uvs=[[0, 1], [1, 1], [1, 0], [0, 0]],
        name="sign",
        textures={"reflectance": raycam.Texture(image, filter="nearest")},
        **keys,  # type: ignore[arg-type]
    )
    return world


def scan_left_and_right(world: raycam.World) -> raycam.Scan:
    ways = [[10, 0.5, 0.3], [10, -0.5, 0.3]]
    return raycam.scan(world, raycam.Lidar.of(ways, noise=False))


def test_textures_of_reflectance_replace_the_colour() -> None:
    image = np.array([[0.25, 0.75]])
    with collected() as notices:
        scan = scan_left_and_right(sign(image, color=[0.9, 0.1, 0.1]))
    cosine = np.cos(np.radians(scan["incidence"].astype(float)))
    np.testing.assert_allclose(scan["reflectivity"], [0.25, 0.75] * cosine, rtol=1e-6)
    assert [notice.code for notice in notices] == []
    world = sign((image * 255).round().astype(np.uint8), color=[0.9, 0.1, 0.1], lidar={"reflectance": 0.5})
    expected = (image[0] * 255).round() / 255 * 0.5
    np.testing.assert_allclose(scan_left_and_right(world)["reflectivity"], expected * cosine, rtol=1e-6)


def test_surfaces_with_a_texture_of_reflectance_scatter_light() -> None:
    scan = scan_left_and_right(sign(np.array([[0.25, 0.75]]), type="glass"))
    assert scan["bounces"].tolist() == [0, 0]
    assert scan["reflectivity"][1] == pytest.approx(3 * scan["reflectivity"][0], rel=1e-6)


def test_field_reflectance_is_nan_without_a_texture() -> None:
    world = sign(np.array([[0.25, 0.75]]))
    world.add_object(box={"size": [1, 1, 1]}, location=[0, 10, 0], name="plain")
    ways = [[10, 0.5, 0], [10, -0.5, 0], [0, 1, 0], [-1, 0, 0]]
    found = world.cast_rays([[0, 0, 0]], ways, fields=("instance", "reflectance"))
    np.testing.assert_array_equal(found["instance"], [0, 0, 1, -1])
    np.testing.assert_array_equal(found["reflectance"], np.array([0.25, 0.75, np.nan, np.nan], np.float32))
