"""Daylight: the sun must be above the horizon."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from support.raises import raises


def sunlight(elevation: float, up: str) -> list[float]:
    """The direction in which light of a sun at this elevation (degrees) travels."""
    across, height = float(np.cos(np.radians(elevation))), float(np.sin(np.radians(elevation)))
    return [-across, 0, -height] if up == "z" else [-across, -height, 0]


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize("elevation", [0.0, 0.1, 45.0, 90.0])
def test_suns_above_the_horizon_are_accepted(up: str, elevation: float) -> None:
    world = raycam.World(up=up)
    world.add_light("daylight", direction=sunlight(elevation, up))
    assert world.lights[0]["type"] == "daylight"


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize("elevation", [-0.5, -18.0, -90.0])
def test_suns_below_the_horizon_are_refused(up: str, elevation: float) -> None:
    world = raycam.World(up=up)
    with raises(raycam.WorldError, mentions=[f"{-elevation:.1f} degrees"]):
        world.add_light("daylight", direction=sunlight(elevation, up))
    assert len(world.lights) == 0
    world.add_light("daylight", direction=sunlight(30, up))
    with raises(raycam.WorldError, mentions=["daylight"]):
        world.set_light(0, type="daylight", direction=sunlight(elevation, up))
