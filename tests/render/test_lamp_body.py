"""Bodies of lamps: lights that occlude and appear in ground truth."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
import raycam

LAMPS: dict[str, dict[str, Any]] = {
    "area": {"type": "area", "u": [0.8, 0, 0], "v": [0.3, -0.6, 0], "radiance": [3, 2, 1]},
    "disk": {"type": "disk", "direction": [0, 0, -1], "radius": 0.4, "radiance": [3, 2, 1]},
    "bulb": {"type": "bulb", "radius": 0.4, "intensity": (np.pi * 0.4**2 * np.array([3, 2, 1])).tolist()},
    "spot": {"type": "spot", "radius": 0.4, "direction": [0, 0, -1], "outer": 90, "intensity": [3, 2, 1]},
}
"""Lights with a size that shine down."""


def lit_from_above(lamp: dict[str, Any], **keys: Any) -> tuple[raycam.World, raycam.Camera]:
    """A floor, a lamp 2 m above it under a sky, and a camera below that looks up at the lamp."""
    world = raycam.World()
    world.add_object(plane={"size": 8}, name="floor", color=[0.5, 0.5, 0.5])
    world.add_light(type="sky", radiance=0.5)
    world.add_light({**lamp, "name": "lamp", "position": [0, 0, 2], **keys})
    camera = raycam.Camera.look_at([0, 0, 0.5], [0, 0, 2], [0, 1, 0], size=(32, 32), fov=50)
    return world, camera


@pytest.mark.parametrize("lamp", LAMPS.values(), ids=LAMPS)
def test_body_appears_in_ids_depth_and_names(lamp: dict[str, Any]) -> None:
    world, camera = lit_from_above(lamp, body=True)
    frame = raycam.render(world, camera, samples=1, channels=["instance", "depth"])
    number = next(index for index, known in enumerate(world.objects) if known.name == "lamp")
    assert frame["instance"][16, 16] == number
    assert frame["instance"][0, 0] == -1
    height = 2 - lamp["radius"] if lamp["type"] in ("bulb", "spot") else 2
    assert frame["depth"][16, 16] == pytest.approx(height - 0.5, abs=5e-3)
    hit = world.cast_rays([[0, 0, 0.5]], [[0, 0, 1]])
    assert hit["instance"][0] == number


@pytest.mark.parametrize("integrator", ["direct", "path"])
@pytest.mark.parametrize("lamp", LAMPS.values(), ids=LAMPS)
def test_body_hides_the_background_and_emits_the_lamps_light(lamp: dict[str, Any], integrator: str) -> None:
    images = {}
    for body in (False, True):
        world, camera = lit_from_above(lamp, body=body)
        frame = raycam.render(world, camera, integrator=integrator, samples=4, channels=["color"])
        images[body] = frame["color"][16, 16].astype(float)
    np.testing.assert_allclose(
        images[False] - images[True], 0.5, rtol=1e-5
    )  # without a body, the sky shows through
    if lamp["type"] != "spot":
        np.testing.assert_allclose(images[True], [3, 2, 1], rtol=1e-5)


def test_body_seen_from_behind_is_black() -> None:
    world, _ = lit_from_above(LAMPS["disk"], body=True)
    above = raycam.Camera.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0], size=(9, 9), fov=10)
    frame = raycam.render(world, above, integrator="path", samples=4, channels=["color", "instance"])
    assert (frame["instance"] == 1).all()
    assert not frame["color"].any()


@pytest.mark.parametrize("body", [False, True])
@pytest.mark.parametrize(("kind", "fraction"), [("disk", 0.2), ("bulb", 0.16 / 0.64)])
def test_body_occludes_the_sky_by_its_form_factor(kind: str, fraction: float, body: bool) -> None:
    """Form factors of a disk of radius R at height h, R² / (R² + h²), and of a sphere, R² / h²."""
    height = 0.8
    world = raycam.World()
    world.add_object(plane={"size": 0.02}, color=[1, 1, 1])
    world.add_light(type="sky", radiance=0.5)
    world.add_light({**LAMPS[kind], "position": [0, 0, height], "body": body, "visible": {"camera": False}})
    camera = raycam.Camera.look_at([0.4, 0, 0.05], [0, 0, 0], size=(8, 8), focal=4000)
    frame = raycam.render(world, camera, integrator="path", max_depth=2, samples=1024, channels=["color"])
    sky = 0.5 * (1 - fraction) if body else 0.5
    expected = sky + fraction * np.array([3, 2, 1])
    np.testing.assert_allclose(frame["color"].mean((0, 1)), expected, rtol=3e-3)


def test_body_casts_a_shadow_and_hides_in_mirrors_unless_it_is_not_visible() -> None:
    def shadow(**keys: Any) -> tuple[float, int]:
        world = raycam.World()
        world.add_object(plane={"size": 8}, color=[1, 1, 1])
        world.add_light(type="sun", direction=[0, 0, -1], irradiance=np.pi)
        world.add_light({**LAMPS["disk"], "direction": [0, 0, 1], "position": [0, 0, 1], **keys})
        camera = raycam.Camera.look_at([3, 0, 0.5], [0, 0, 0], size=(5, 5), fov=1)
        frame = raycam.render(world, camera, integrator="direct", samples=1, channels=["color"])
        lamp = raycam.Camera.look_at([0, 0, 3], [0, 0, 1], [0, 1, 0], size=(1, 1), fov=1)
        seen = raycam.render(world, lamp, samples=1, channels=["instance"])["instance"][0, 0]
        return float(frame["color"].mean()), int(seen)

    assert shadow() == (pytest.approx(1), 0)
    assert shadow(body=True) == (pytest.approx(0), 1)
    assert shadow(body=True, visible={"camera": False}) == (pytest.approx(0), 0)


def test_body_follows_its_light() -> None:
    world, _ = lit_from_above(LAMPS["area"], body=True)
    world.add_light({**LAMPS["bulb"], "name": "second", "position": [3, 0, 2], "body": True})
    assert [known.name for known in world.objects] == ["floor", "lamp", "second"]

    def hit(x: float) -> list[int]:
        return world.cast_rays([[x, 0, 0.5]], [[0, 0, 1]])["instance"].tolist()

    world.set_light(1, position=[1, 0, 2])
    assert (hit(0), hit(1), hit(3)) == ([-1], [1], [2])
    world.set_light(
        1, {"type": "disk", "position": [0, 0, 2], "direction": [0, 0, 1], "radius": 0.1, "radiance": 1}
    )
    assert [known.name for known in world.objects] == ["floor", "second"]
    world.set_light(1, body=True)
    assert world.lights[1]["body"] is True
    assert (hit(0), hit(0.2)) == ([2], [-1])
    restored = pickle.loads(pickle.dumps(world))
    restored.remove_light(1)
    assert [known.name for known in restored.objects] == ["floor", "second"]
    restored.set_light(1, position=[0, 0, 2])
    assert restored.cast_rays([[0, 0, 0.5]], [[0, 0, 1]])["instance"].tolist() == [1]
    world.remove_object("second")
    assert "body" not in world.lights[2]
    assert hit(3) == [-1]


@pytest.mark.parametrize(
    "keys",
    [
        {"type": "sky", "radiance": 1},
        {"type": "sun", "direction": [0, 0, -1], "irradiance": 1},
        {"type": "bulb", "position": [0, 0, 1], "power": 1},
    ],
)
def test_body_of_a_light_without_a_size_is_refused(keys: dict[str, Any]) -> None:
    world = raycam.World()
    with pytest.raises(raycam.WorldError) as caught:
        world.add_light({**keys, "body": True})
    assert caught.value.code == "invalid_light"
    assert keys["type"].replace("bulb", "point") in str(caught.value)
    assert not world.lights
    assert not world.objects
