"""Progressive images: at any time they equal `render` with the same number of samples."""

from __future__ import annotations

import re
import threading
from typing import Any

import numpy as np
import pytest
import raycam
from support.patience import PATIENCE
from support.raises import Fault, fault, raises

CHANNELS = ("color", "alpha", "coverage")


@pytest.fixture(scope="module")
def world() -> raycam.World:
    checks = (np.indices((64, 64)).sum(axis=0) % 2 * 255).astype(np.uint8)
    made = raycam.World()
    made.add_object(plane={"size": [8, 8]}, texture=np.repeat(checks[..., None], 3, axis=2), name="floor")
    made.add_object(sphere={"radius": 0.5}, location=[0, 0, 0.5], color="#c83c28", name="ball")
    made.add_object(box={"size": 0.5}, location=[0.6, 0.4, 0.25], emission=[2, 2, 1], name="lamp")
    made.add_light("sun", direction=[-1, 1, -2], irradiance=3)
    return made


@pytest.fixture(scope="module")
def camera() -> raycam.Camera:
    return raycam.Camera.look_at([3, -3, 2], [0, 0, 0.3], size=(50, 41), fov=40)


def expected(world: raycam.World, camera: raycam.Camera, samples: int, **options: Any) -> dict[str, bytes]:
    frame = raycam.render(world, camera, samples=samples, **{"channels": CHANNELS, **options})
    return {name: array.tobytes() for name, array in frame.items()}


def bytes_of(frame: raycam.Frame) -> dict[str, bytes]:
    return {name: array.tobytes() for name, array in frame.items()}


@pytest.mark.parametrize("integrator", ["flat", "direct", "path", "ao"])
@pytest.mark.parametrize("threads", [1, 2])
def test_samples_added_in_slices_equal_one_render(
    world: raycam.World, camera: raycam.Camera, integrator: Any, threads: int
) -> None:
    slices = np.random.default_rng(threads).integers(1, 9, 6)
    picture = raycam.Progressive(world, camera, integrator=integrator, channels=CHANNELS, threads=threads)
    for count in slices:
        picture.add(int(count))
        if picture.samples in (1, 2, 7, 16, 17) or picture.samples == slices.sum():
            assert bytes_of(picture.frame()) == expected(
                world, camera, picture.samples, integrator=integrator
            )
    assert picture.samples == slices.sum()


@pytest.mark.parametrize("integrator", ["direct", "path"])
def test_first_samples_of_untextured_worlds_do_not_depend_on_the_total(
    camera: raycam.Camera, integrator: Any
) -> None:
    plain = raycam.World()
    plain.add_object(plane={"size": [8, 8]}, color="#808080")
    plain.add_object(sphere={"radius": 0.5}, location=[0, 0, 0.5], type="glass")
    plain.add_light("sun", direction=[-1, 1, -2], irradiance=3)
    picture = raycam.Progressive(plain, camera, integrator=integrator, channels=CHANNELS)
    for count in (2, 2, 12, 16):  # up to 16 samples, the cone of a sample gets narrower
        picture.add(count)
        assert bytes_of(picture.frame()) == expected(plain, camera, picture.samples, integrator=integrator)


@pytest.mark.parametrize("integrator", ["direct", "path"])
@pytest.mark.parametrize("texture", [None, np.full((4, 4, 3), 128, np.uint8)], ids=["plain", "textured"])
def test_clamp_notice_equals_that_of_render(camera: raycam.Camera, integrator: Any, texture: Any) -> None:
    # With a texture the first samples are discarded twice and are not counted.
    world = raycam.World()
    world.add_object(box={"size": 1}, **({"color": "#808080"} if texture is None else {"texture": texture}))
    world.add_light("sky", radiance=1)
    picture = raycam.Progressive(world, camera, integrator=integrator, clamp=0.05, channels="color")
    counts = set()
    for count in (1, 1, 2, 12, 16):
        picture.add(count)
        frame = raycam.render(world, camera, integrator=integrator, clamp=0.05, samples=picture.samples)
        notices = picture.frame().notices
        assert notices == picture.frame().notices == frame.notices
        clamped = [str(notice) for notice in notices if notice.code == "clamped_samples"]
        counts |= {found[1] for text in clamped if (found := re.search(r"\((\d+) sample", text))}
    assert len(counts) == 5


def test_clamp_notice_excludes_cancelled_samples(world: raycam.World, camera: raycam.Camera) -> None:
    options: dict[str, Any] = {"integrator": "path", "clamp": 0.05, "channels": "color"}
    picture = raycam.Progressive(world, camera, **options)
    picture.add(17)
    cancel = raycam.Cancel()
    watch = threading.Timer(0.02, cancel.cancel)
    watch.start()
    with pytest.raises(raycam.Cancelled):
        picture.add(1 << 14, cancel=cancel)
    watch.join()
    until = max(picture.samples, 17) + 3
    picture.add(until - picture.samples)
    assert picture.frame().notices == raycam.render(world, camera, samples=until, **options).notices


@pytest.mark.parametrize("time_limit", [0.05, 0.5])
def test_notices_of_a_render_with_a_time_limit_equal_those_with_its_sample_count(
    world: raycam.World, camera: raycam.Camera, time_limit: float
) -> None:
    options: dict[str, Any] = {"integrator": "path", "clamp": 0.05, "channels": "color"}
    first, *notices = raycam.render(world, camera, time_limit=time_limit, **options).notices
    again = raycam.render(world, camera, samples=int(str(first).split()[0]), **options)
    assert notices == again.notices


def test_error_channel_equals_that_of_render(world: raycam.World, camera: raycam.Camera) -> None:
    picture = raycam.Progressive(world, camera, channels=["color", "error"], seed=4)
    picture.add(5)
    picture.add(28)
    assert bytes_of(picture.frame()) == expected(world, camera, 33, channels=["color", "error"], seed=4)


def test_samples_added_to_a_region_leave_the_rest_unchanged(
    world: raycam.World, camera: raycam.Camera
) -> None:
    picture = raycam.Progressive(world, camera, channels="color")
    picture.add(17)
    assert picture.add(4, region=(0, 0, 1, 1)) == 21
    assert picture.samples == 17
    mixed = picture.frame()["color"]
    few, many = (raycam.render(world, camera, samples=n, channels="color")["color"] for n in (17, 21))
    is_many = (mixed == many).all(axis=2)
    assert ((mixed == few).all(axis=2) | is_many).all()
    assert is_many[0, 0]
    assert not is_many[-1].all()
    picture.add(4)
    assert (picture.frame()["color"] == many).all()


@pytest.mark.parametrize("wait", [0.0, 0.002, 0.01, 0.05])
def test_cancelled_image_continues_to_the_same_bytes(
    world: raycam.World, camera: raycam.Camera, wait: float
) -> None:
    picture = raycam.Progressive(
        world, camera, integrator="path", channels=CHANNELS, threads=2, samples=1 << 24
    )
    picture.add(3)
    cancel = raycam.Cancel()
    watch = threading.Timer(wait, cancel.cancel)
    watch.start()
    with pytest.raises(raycam.Cancelled):
        picture.add_for(86400, cancel=cancel)
    watch.join()
    assert cancel.is_cancelled
    # When the image was stopped, some tiles were up to one round of 64 samples ahead.
    reached = picture.samples + 64
    picture.add(64)
    assert bytes_of(picture.frame()) == expected(world, camera, reached, integrator="path")


def test_add_for_stops_at_the_requested_samples(world: raycam.World, camera: raycam.Camera) -> None:
    picture = raycam.Progressive(world, camera, channels=CHANNELS, samples=21)
    assert picture.add_for(3600) == 21
    assert bytes_of(picture.frame()) == expected(world, camera, 21)
    assert picture.add_for(3600) == 21
    again = raycam.Progressive(world, camera, samples=64)
    steps = 0
    while again.add_for(0) < 64:
        steps += 1
    assert steps > 1


def test_progressive_image_of_a_moving_world_equals_render(
    world: raycam.World, camera: raycam.Camera
) -> None:
    lens = camera.replace(distortion=[-0.2, 0.05, 0, 0], model="opencv").with_aperture(0.05, focus=3.0)
    picture = raycam.Progressive(world, lens, channels=CHANNELS, region=(10, 7, 30, 22))
    picture.add(2)
    picture.add(6)
    frame = picture.frame()
    assert frame.region == (10, 7, 30, 22)
    assert bytes_of(frame) == expected(world, lens, 8, region=(10, 7, 30, 22))


def test_restart_discards_the_samples(world: raycam.World, camera: raycam.Camera) -> None:
    picture = raycam.Progressive(world, camera, channels="color", seed=3)
    picture.add(4)
    moved = camera.at_pose(camera.R, camera.location + 0.1)
    assert picture.restart(camera=moved).samples == 0
    picture.add(4)
    assert bytes_of(picture.frame()) == expected(world, moved, 4, channels="color", seed=3)


def test_iteration_doubles_the_samples(world: raycam.World, camera: raycam.Camera) -> None:
    frames = list(raycam.progressive(world, camera, channels="color", samples=6))
    for frame, samples in zip(frames, (1, 2, 4, 6), strict=True):
        assert bytes_of(frame) == expected(world, camera, samples, channels="color")
    cancel = raycam.Cancel()
    loop = raycam.progressive(world, camera, every=0.001, cancel=cancel)
    next(loop)
    cancel.cancel()
    assert list(loop) == []


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"channels": ["color", "depth"]}, fault("conflicting_values", "'depth'")),
        ({"noise_threshold": 0.1}, fault("conflicting_values", "noise_threshold")),
        ({"time_limit": 1}, fault("conflicting_values", "time_limit")),
        ({"integrator": "reference"}, fault("conflicting_values", "reference")),
        ({"sample": 3}, fault("unknown_key", "'sample'")),
    ],
)
def test_unsupported_options_of_progressive_are_refused(
    world: raycam.World, camera: raycam.Camera, options: dict[str, Any], words: Fault
) -> None:
    with raises((raycam.SettingsError, TypeError), **words):
        raycam.Progressive(world, camera, **options)


def test_frame_without_samples_raises(world: raycam.World, camera: raycam.Camera) -> None:
    picture = raycam.Progressive(world, camera)
    with raises(raycam.SettingsError, code="invalid_settings", mentions=["samples"]):
        picture.frame()
    with raises(raycam.SettingsError, code="out_of_range", mentions=["seconds"]):
        picture.add_for(float("nan"))
    with raises(raycam.SettingsError, code="out_of_range", mentions=["samples"]):
        picture.add(0)


def test_cancel_stops_render_and_ray_queries(world: raycam.World, camera: raycam.Camera) -> None:
    cancel = raycam.Cancel()
    timer = threading.Timer(0.05, cancel.cancel)
    timer.start()
    with pytest.raises(raycam.Cancelled):
        raycam.render(world, camera.resized((640, 525)), integrator="path", samples=1 << 14, cancel=cancel)
    timer.join()
    rays = np.tile([0.0, 0.0, 5.0], (300_000, 1))
    with pytest.raises(raycam.Cancelled):
        world.cast_rays(rays, [0, 0, -1], cancel=cancel)
    frame = raycam.render(world, camera, cancel=raycam.Cancel())
    assert bytes_of(frame) == bytes_of(raycam.render(world, camera))


def test_small_image_does_not_wait_for_a_large_image(world: raycam.World, camera: raycam.Camera) -> None:
    cancel, begun, ended = raycam.Cancel(), threading.Event(), threading.Event()

    def long() -> None:
        begin = {"cancel": cancel, "progress": lambda *_: begun.set()}
        with pytest.raises(raycam.Cancelled):
            raycam.render(world, camera.resized((640, 525)), integrator="path", samples=1 << 24, **begin)
        ended.set()

    thread = threading.Thread(target=long)
    thread.start()
    assert begun.wait(PATIENCE)
    small = threading.Thread(target=lambda: raycam.render(world, camera.resized((80, 66)), samples=4))
    small.start()
    small.join(PATIENCE)  # a tile of the long image takes hours
    assert not small.is_alive()
    assert not ended.is_set()
    cancel.cancel()
    thread.join()
    assert ended.is_set()
