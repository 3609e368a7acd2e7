"""Blocks of pulses."""

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
