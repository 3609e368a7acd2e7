"""Still pictures from coarse to fine."""

from __future__ import annotations

import pytest
import raycam
from raycam.render.frame import CHANNELS
from raycam.viewer.stills import COLORS, TRUTH, FromScratch, truth


def test_every_channel_is_of_samples_or_of_truth() -> None:
    assert sorted([*COLORS, *TRUTH, "error", "shadow"]) == sorted(CHANNELS)


def test_each_step_is_the_picture_of_its_samples(small_world: raycam.World) -> None:
    camera = small_world.camera("front")
    refinement = FromScratch(small_world, camera, "path", 20, 1)
    counts = []
    while frame := refinement.refine(lambda done, total: None):
        counts.append(refinement.samples)
        expected = raycam.render(small_world, camera, integrator="path", samples=counts[-1], channels=COLORS)
        assert frame["color"].tobytes() == expected["color"].tobytes()
    assert counts == [4, 16, 20]


def test_a_stopped_step_is_taken_again(small_world: raycam.World) -> None:
    class Stop(Exception):
        pass

    def stop(done: int, total: int) -> None:
        raise Stop

    refinement = FromScratch(small_world, small_world.camera("front").resized((240, 160)), "path", 4096, 1)
    refinement.refine(lambda done, total: None)
    refinement.samples = 1024  # the next step is long enough to be stopped
    with pytest.raises(Stop):
        refinement.refine(stop)
    assert refinement.samples == 1024


def test_truth_is_that_of_the_picture(small_world: raycam.World) -> None:
    camera = small_world.camera("front")
    expected = raycam.render(small_world, camera, samples=9, channels=TRUTH)
    found = truth(small_world, camera)
    assert {name: array.tobytes() for name, array in found.items()} == {
        name: array.tobytes() for name, array in expected.items()
    }
