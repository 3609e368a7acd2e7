"""Progressive refinement of still images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.render.frame import CHANNELS, PASSES
from raycam.viewer import stills
from raycam.viewer.stills import COLORS, TRUTH, FromScratch, Slices, refinement, truth


def test_every_channel_is_sampled_or_ground_truth() -> None:
    assert sorted([*COLORS, *TRUTH, "error", "shadow", *PASSES]) == sorted(CHANNELS)


@pytest.mark.parametrize("kind", [Slices, FromScratch])
def test_each_step_equals_a_render_of_its_samples(
    small_world: raycam.World, kind: type[Slices] | type[FromScratch]
) -> None:
    camera = small_world.camera("front")
    refinement = kind(small_world, camera, "path", 20, 1)
    while refinement.samples < 20:
        frame = refinement.refine(raycam.Cancel())
        if frame is not None and refinement.samples:
            few = raycam.render(
                small_world, camera, integrator="path", samples=refinement.samples, channels=COLORS
            )
            same = (frame["color"] == few["color"]).all(axis=2)
            assert same.all() if refinement.samples == 20 else same.any()
    assert refinement.refine(raycam.Cancel()) is None


@pytest.mark.parametrize("kind", [Slices, FromScratch])
def test_refinement_change_is_the_difference_from_half_as_many_samples(
    small_world: raycam.World, kind: type[Slices] | type[FromScratch], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stills, "SLICE", 0.0)  # otherwise one step renders all samples
    refinement = kind(small_world, small_world.camera("front"), "path", 64, 1)
    shown: dict[int, np.ndarray] = {}
    while refinement.samples < 64:
        frame = refinement.step(raycam.Cancel())
        if frame is None:
            continue
        now = np.asarray(frame["color"], np.float64) @ [0.2126, 0.7152, 0.0722]
        shown.setdefault(refinement.samples, now)
        if refinement.change is not None:
            share, since = refinement.change
            before = shown[since]
            assert 2 * since <= refinement.samples
            assert share == pytest.approx(np.abs(now - before).mean() / np.abs(now).mean(), rel=1e-4)
    assert refinement.change is not None
    width, height = refinement.camera.size
    assert refinement.rate * refinement.seconds == pytest.approx(64 * width * height)


@pytest.mark.parametrize("kind", [Slices, FromScratch])
def test_cancelled_step_is_repeated(
    small_world: raycam.World, kind: type[Slices] | type[FromScratch]
) -> None:
    refinement = kind(small_world, small_world.camera("front"), "path", 16, 1)
    stopped = raycam.Cancel()
    stopped.cancel()
    with pytest.raises(raycam.Cancelled):
        refinement.refine(stopped)
    assert refinement.samples == 0
    while refinement.refine(raycam.Cancel()) is None or refinement.samples < 16:
        pass
    assert refinement.samples == 16


def test_background_photo_is_part_of_the_image(small_world: raycam.World, tmp_path: Path) -> None:
    raycam.render(small_world, small_world.camera("side")).save(tmp_path / "behind.png")
    camera = small_world.camera("front").with_background(tmp_path / "behind.png")
    made = refinement(small_world, camera, "direct", 4, 1)
    frame = made.refine(raycam.Cancel())
    assert frame is not None
    assert (frame["color"] == raycam.render(small_world, camera, samples=4)["color"]).all()
    assert isinstance(refinement(small_world, small_world.camera("front"), "direct", 4, 1), Slices)


def test_ground_truth_of_stills_equals_ground_truth_of_render(small_world: raycam.World) -> None:
    camera = small_world.camera("front")
    expected = raycam.render(small_world, camera, samples=9, channels=TRUTH)
    found = truth(small_world, camera)
    assert {name: array.tobytes() for name, array in found.items()} == {
        name: array.tobytes() for name, array in expected.items()
    }


@pytest.mark.parametrize(("showing", "most_frames"), [(0.01, 12), (1.0, 4)])
def test_intermediate_images_take_at_most_a_quarter_of_the_time(
    small_world: raycam.World, monkeypatch: pytest.MonkeyPatch, showing: float, most_frames: int
) -> None:
    now, added = 0.0, 0

    class Slow:
        def add_for(self, seconds: float, cancel: raycam.Cancel) -> int:
            nonlocal now, added
            now, added = now + seconds, added + 1
            return added // 10  # all samples take 190 slices, which are 5.7 seconds

        def frame(self) -> str:
            return "frame"

    monkeypatch.setattr(stills.time, "monotonic", lambda: now)
    monkeypatch.setattr(stills, "Progressive", lambda *_, **__: Slow())
    refinement = Slices(small_world, small_world.camera("front"), "path", 19, 1)
    told = []
    while refinement.samples < 19:
        if refinement.refine(raycam.Cancel()):
            told.append(refinement.samples)
            now += showing
    assert told[0] == 1
    assert told[-1] == 19
    assert 3 <= len(told) <= most_frames + 1
