"""Rendering: settings, determinism, interruption, forks, and exact colours."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.render import INTEGRATORS, channel_names
from raycam.render.frame import CHANNELS
from support.patience import PATIENCE, once_at_work
from support.raises import raises


def box_world() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": 1}, color="#c83c28")
    world.add_object(plane={"size": 8}, location=[0, 0, -0.5])
    world.add_light(type="sun", direction=[-1, 1, -2], irradiance=[2, 2, 2])
    world.add_light(type="sky", radiance=[0.3, 0.3, 0.4])
    return world


def camera(size: tuple[int, int] = (48, 36)) -> raycam.Camera:
    return raycam.Camera.look_at([3, -4, 2], [0, 0, 0], size=size)


def assert_same(a: raycam.Frame, b: raycam.Frame) -> None:
    assert a.channels == b.channels
    for name in a:
        assert a[name].tobytes() == b[name].tobytes(), name


def test_channels_have_the_dtypes_and_shapes_of_the_table() -> None:
    frame = raycam.render(box_world(), camera(), channels="all", samples=2)
    assert set(frame) == set(CHANNELS)
    for name, (dtype, components) in CHANNELS.items():
        assert frame[name].dtype == dtype
        assert frame[name].shape == ((36, 48) if components == 1 else (36, 48, components))
        assert frame[name].flags.c_contiguous
        assert frame[name].flags.writeable


def test_background_pixels_have_the_documented_values() -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 0.1})
    frame = raycam.render(world, camera(), integrator="flat", channels="all")
    corner = {name: array[0, 0] for name, array in frame.items()}
    assert corner["depth"] == corner["distance"] == np.inf
    assert corner["instance"] == corner["triangle"] == -1
    assert np.isnan(corner["position"]).all()
    assert (corner["normal"] == 0).all()
    assert (corner["barycentric"] == 0).all()
    assert (corner["color"] == 0).all()
    assert corner["coverage"] == 1


def test_channel_names_accepts_names_lists_and_all() -> None:
    assert channel_names("depth") == ["depth"]
    assert channel_names(["depth", "color", "depth"]) == ["depth", "color"]
    assert channel_names("all") == list(CHANNELS)


@pytest.mark.parametrize("integrator", [name for name in INTEGRATORS if name != "reference"])
def test_render_does_not_depend_on_the_number_of_threads(integrator: str) -> None:
    keys = {"integrator": integrator, "samples": 5, "channels": "all", "filter": "blackman-harris", "seed": 3}
    expected = raycam.render(box_world(), camera(), threads=1, **keys)  # type: ignore[arg-type]
    for threads in (2, 3, 8, None):
        assert_same(raycam.render(box_world(), camera(), threads=threads, **keys), expected)  # type: ignore[arg-type]


def test_released_image_memory_is_reused() -> None:
    # Most of the image is background, where colour, normals and weights are 0.
    world, seen = raycam.World(), camera((256, 160))
    world.add_object(sphere={"radius": 0.3})

    def render() -> raycam.Frame:
        return raycam.render(world, seen, integrator="flat", samples=1, channels=list(CHANNELS)[:-1])

    frame = render()
    first = {name: array.tobytes() for name, array in frame.items()}
    places = {array.ctypes.data for array in frame.values()}
    assert all(place % 64 == 0 for place in places)
    for array in frame.values():
        array.view(np.uint8)[...] = 0xAB
    held, row = frame["position"], frame["depth"][7]
    kept = {held.ctypes.data, frame["depth"].ctypes.data}
    del array, frame
    again = render()
    assert {name: array.tobytes() for name, array in again.items()} == first
    used = {array.ctypes.data for array in again.values()}
    assert not used & kept
    assert len(used & places) >= len(places) - 2
    assert (held.view(np.uint8) == 0xAB).all()
    assert (row.view(np.uint8) == 0xAB).all()


def test_seed_and_frame_determine_the_noise() -> None:
    world = box_world()

    def color(**keys: int) -> bytes:
        return raycam.render(world, camera(), samples=2, **keys)["color"].tobytes()  # type: ignore[arg-type]

    assert color() == color(seed=0, frame=0)
    assert len({color(), color(seed=1), color(frame=1)}) == 3


def test_regions_merge_into_the_whole_image() -> None:
    world = box_world()
    keys = {"samples": 3, "channels": "all"}
    whole = raycam.render(world, camera(), **keys)  # type: ignore[arg-type]
    regions = [(0, 0, 20, 10), (20, 0, 28, 10), (0, 10, 48, 26)]
    parts = [raycam.render(world, camera(), region=region, **keys) for region in regions]  # type: ignore[arg-type]
    assert [part.region for part in parts] == regions
    assert parts[0]["color"].shape == (10, 20, 3)
    assert_same(raycam.Frame.merge(parts), whole)


def test_reference_renderer_returns_the_same_image() -> None:
    world = box_world()
    keys = {"channels": ["instance", "triangle", "depth", "position", "color"]}
    frame = raycam.render(world, camera(), integrator="flat", samples=1, **keys)  # type: ignore[arg-type]
    oracle = raycam.render(world, camera(), integrator="reference", **keys)  # type: ignore[arg-type]
    for name in ("instance", "triangle"):
        np.testing.assert_array_equal(frame[name], oracle[name])
    np.testing.assert_allclose(frame["depth"], oracle["depth"], rtol=1e-6)
    np.testing.assert_allclose(frame["position"], oracle["position"], rtol=1e-9, atol=1e-9)
    hit = frame["instance"] >= 0
    np.testing.assert_allclose(frame["color"][hit], oracle["color"][hit], atol=1e-6)


def test_render_settings_of_the_world_file_apply_unless_given() -> None:
    description = {
        "object": [{"box": {"size": 1}}],
        "light": [{"type": "sky", "radiance": [1, 1, 1]}],
        "render": {"integrator": "flat", "samples": 3, "seed": 7, "exposure": 1.5},
    }
    world = raycam.World.from_dict(description)
    assert world.render_settings == {"integrator": "flat", "samples": 3, "seed": 7, "exposure": 1.5}
    frame = raycam.render(world, camera())
    assert frame.exposure == 1.5
    assert_same(frame, raycam.render(world, camera(), integrator="flat", samples=3, seed=7))
    assert raycam.render(world, camera(), exposure=0.0).exposure == 0.0


def test_world_without_lights_gets_a_sky_and_a_notice() -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 1}, color=[0.5, 0.5, 0.5])
    frame = raycam.render(world, camera(), samples=4)
    assert any(notice.code == "default_lights" for notice in frame.notices)
    assert frame["color"].min() > 0
    flat = raycam.render(world, camera(), integrator="flat", samples=1)
    assert not flat.notices
    assert (flat["color"][0, 0] == 0).all()
    assert world.lights == []


def test_every_srgb_color_byte_is_rendered_unchanged() -> None:
    world = raycam.World()
    for value in range(256):
        r, g, b = value, (value * 7 + 3) % 256, 255 - value
        at = [value % 16, 0, value // 16]
        world.add_object(plane={"size": 0.9}, roll=90, location=at, color=f"#{r:02x}{g:02x}{b:02x}")
    k = [[100.0, 0, 80], [0, 100, 80], [0, 0, 1]]
    seen = raycam.Camera.look_at([7.5, -10, 7.5], [7.5, 0, 7.5], size=(161, 161), K=k)
    frame = raycam.render(world, seen, integrator="flat", samples=4)
    pixels = frame.to_srgb8()
    for value in range(256):
        at = np.array([value % 16, 0.0, value // 16])
        (u, v), _ = seen.project(at)
        expected = [value, (value * 7 + 3) % 256, 255 - value]
        assert pixels[round(v), round(u)].tolist() == expected


def test_byte_face_colors_are_rendered_unchanged() -> None:
    rgb = np.arange(256, dtype=np.uint8)[:, None] + np.array([0, 50, 100], np.uint8)
    corners = np.array([[0.0, 0, 0], [0.9, 0, 0], [0, 0, 0.9]])
    offsets = np.stack([np.arange(256) % 16, np.zeros(256), np.arange(256) // 16], axis=1)
    vertices = (offsets[:, None] + corners).reshape(-1, 3)
    world = raycam.World()
    world.add_mesh(vertices, np.arange(768).reshape(-1, 3), face_colors=rgb)
    seen = raycam.Camera.look_at([8, -20, 8], [8, 0, 8], size=(400, 400), fov=45)
    pixels = raycam.render(world, seen, integrator="flat", samples=1).to_srgb8()
    columns, rows = np.rint(seen.project(vertices.reshape(-1, 3, 3).mean(axis=1))[0]).astype(int).T
    np.testing.assert_array_equal(pixels[rows, columns], rgb)


def slow(
    progress: Callable[[int, int], object] | None = None, cancel: raycam.Cancel | None = None
) -> raycam.Frame:
    """Starts a render that would take days, so it returns only if it is stopped."""
    return raycam.render(
        box_world(),
        camera((4000, 3000)),
        samples=100_000,
        channels="color",
        progress=progress,
        cancel=cancel,
    )


def test_progress_counts_up_to_the_end() -> None:
    seen: list[tuple[int, int]] = []
    raycam.render(box_world(), camera((640, 480)), samples=8, progress=lambda *now: seen.append(now))
    done, total = zip(*seen, strict=True)
    assert list(done) == sorted(done)
    assert len(set(total)) == 1
    assert seen[-1][0] == seen[-1][1]


def test_exception_raised_by_the_progress_callback_stops_rendering() -> None:
    def stop(done: int, total: int) -> None:
        raise RuntimeError(f"enough at {done} of {total}")

    with raises(RuntimeError, mentions=["1175000000"]):
        slow(stop)


INTERRUPTED = """
import os, signal, sys, threading
sys.path[:0] = sys.argv[2:]
from support.patience import once_at_work
from test_render import slow

try:
    once_at_work(lambda: os.kill(os.getpid(), signal.SIGINT))
    if sys.argv[1] == "main":
        slow()
    else:
        worker = threading.Thread(target=slow, daemon=True)
        worker.start()
        worker.join()
except KeyboardInterrupt:
    os._exit(0)
os._exit(1)
"""


@pytest.mark.parametrize("where", ["main", "thread"])
def test_ctrl_c_stops_rendering(where: str) -> None:
    here = Path(__file__).resolve().parent
    command = [sys.executable, "-c", INTERRUPTED, where, str(here), str(here.parent)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr


def render_in_child(queue: multiprocessing.SimpleQueue[bytes]) -> None:
    queue.put(raycam.render(box_world(), camera(), samples=2)["color"].tobytes())


@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_rendering_works_before_and_after_a_fork() -> None:
    expected = raycam.render(box_world(), camera(), samples=2)["color"].tobytes()
    context = multiprocessing.get_context("fork")
    queue = context.SimpleQueue()
    for _ in range(2):
        child = context.Process(target=render_in_child, args=(queue,))
        child.start()
        child.join(PATIENCE)
        assert child.exitcode == 0
        assert queue.get() == expected
    assert raycam.render(box_world(), camera(), samples=2)["color"].tobytes() == expected


def test_python_threads_can_render_one_world() -> None:
    world = box_world()
    expected = raycam.render(box_world(), camera(), samples=2)
    with ThreadPoolExecutor(4) as pool:
        for frame in pool.map(lambda _: raycam.render(world, camera(), samples=2), range(8)):
            assert_same(frame, expected)


FIRST = """
import sys, threading
import raycam

sys.setswitchinterval(1e-6)
world, start = raycam.load(sys.argv[1]), threading.Barrier(4)
view = raycam.Camera.look_at([3, -4, 2], [0, 0, 0], size=(320, 240))

def render():
    start.wait()
    raycam.render(world, view, samples=1)

for _ in range(4):
    threading.Thread(target=render).start()
"""


def test_first_images_of_a_process_can_start_in_several_threads(tmp_path: Path) -> None:
    """The first image imports modules, which lets other Python threads run."""
    world = tmp_path / "world.toml"
    world.write_text("[[object]]\nbox = { size = 1 }\n")
    command = [sys.executable, "-c", FIRST, str(world)]
    for _ in range(6):
        subprocess.run(command, timeout=PATIENCE, check=True)


def test_gil_is_released_while_rendering() -> None:
    stop, cancel, begun = threading.Event(), raycam.Cancel(), threading.Event()
    ticks = 0

    def tick() -> None:
        nonlocal ticks
        begun.wait()
        while ticks < 100 and not stop.wait(0.001):
            ticks += 1
        cancel.cancel()

    ticker = threading.Thread(target=tick)
    ticker.start()
    start = time.process_time()

    def enough(done: int, total: int) -> None:
        begun.set()
        # The result is computed, although the other thread never ran.
        if time.process_time() - start > PATIENCE:
            raise TimeoutError

    with pytest.raises(raycam.Cancelled):
        slow(enough, cancel=cancel)
    stop.set()
    ticker.join()
    assert ticks == 100


def test_signal_handlers_run_while_rendering() -> None:
    def handler(*_: object) -> None:
        raise InterruptedError("the handler ran")

    before = signal.signal(signal.SIGUSR1, handler)
    try:
        once_at_work(lambda: os.kill(os.getpid(), signal.SIGUSR1))
        with pytest.raises(InterruptedError, match="the handler ran"):
            slow()
    finally:
        signal.signal(signal.SIGUSR1, before)
