"""The points of a lidar in a browser: values of the point under the pointer.

Requires Chromium: `make proof`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import pytest
import raycam
from raycam.viewer.server import Server
from raycam.viewer.session import Session
from support.chromium import Tab
from support.viewer_page import opened, place_of, text_of

pytestmark = pytest.mark.proof
SIZE = (48, 36)


@pytest.fixture
def hall() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": [0.2, 30, 20]}, location=[10.1, 0, 0], name="wall", color=[0.5] * 3)
    world.add_object(box={"size": [1, 1, 1]}, location=[5, 0, 0], name="crate", color=[0.9] * 3)
    world.add_light("sky", radiance=1)
    world.add_sensor(raycam.Lidar("vlp16", noise=False), "top")
    return world


@pytest.fixture
def hall_server(hall: raycam.World) -> Iterator[Server]:
    camera = raycam.Camera.look_at([0, 2, 1], [7, 0, 0], fov=50, size=SIZE)
    made = Server(lambda: Session(hall, camera, samples=4, title="hall"), port=0)
    yield made
    made.close()


@pytest.mark.parametrize("name", ["wall", "crate"])
def test_pointer_over_a_point_shows_its_fields(
    name: str, tab: Tab, hall_server: Server, hall: raycam.World
) -> None:
    session = opened(tab, hall_server, 4)
    tab.evaluate(
        "(() => { const list = document.getElementById('scan-lidar'); list.value = 'top';"
        " list.dispatchEvent(new Event('change')); })()"
    )
    tab.wait("/points/.test(document.getElementById('scan-values').textContent)")
    (layer,) = [each for each in session.overlay(session.view) if "points" in each]
    drawn = np.reshape(layer["points"], (-1, 3))
    scan = raycam.scan(hall, "top")
    step = -(-scan.count // 6000)
    instance = scan["instance"][::step][drawn[:, 0].astype(int)]
    index = [item.name for item in hall.objects].index(name)
    number, x, y = drawn[np.flatnonzero(instance == index)[10]]
    tab.mouse("mouseMoved", *place_of(tab, x - 0.5, y - 0.5, session.view.still_camera.size))
    tab.wait("/ring/.test(document.getElementById('scan-values').textContent)")
    found = re.fullmatch(
        r"(.+) m, ring (.+), (.+) ms, intensity (.+), return (.+), object (.+)", text_of(tab, "scan-values")
    )
    assert found is not None
    point = {
        field: scan[field][::step][int(number)]
        for field in ("distance", "ring", "time", "intensity", "return")
    }
    point["time"] *= 1e3
    values = [float(text) for text in found.groups()[:5]]
    np.testing.assert_allclose(values, [float(value) for value in point.values()], rtol=1e-4, atol=6e-5)
    assert found[6] == name


def test_colours_follow_the_chosen_field(tab: Tab, hall_server: Server) -> None:
    opened(tab, hall_server, 4)
    choose = (
        "(() => {{ const list = document.getElementById('{}'); list.value = '{}';"
        " list.dispatchEvent(new Event('change')); }})()"
    )
    tab.evaluate(choose.format("scan-lidar", "top"))
    tab.wait("/points/.test(document.getElementById('scan-values').textContent)")
    images = set()
    for field in ("ring", "time", "intensity", "instance"):
        tab.evaluate(choose.format("scan-field", field))
        images.add(tab.evaluate("document.getElementById('picture').toDataURL()"))
    assert len(images) == 4
