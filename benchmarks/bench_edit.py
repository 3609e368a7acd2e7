"""Measures depth images of 64 x 64 pixels after an object of the world has moved.

For comparison, the camera moves by the same distance. Figures are processor time of all threads per call, in
microseconds: the best of several rounds, in which the loops alternate. Every loop does what a user's program
does: it changes the world and renders an image.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import raycam
import report

SIZE = (64, 64)


def camera(moved: npt.ArrayLike = (0, 0, 0)) -> raycam.Camera:
    eye, target = np.add([6, -2, 3], moved), np.add([0, 0, 0.5], moved)
    return raycam.Camera.look_at(eye, target, [0, 0, 1], size=SIZE, fov=40)


def ball(levels: int) -> dict[str, object]:
    return {"sphere": {"radius": 0.6, "level": levels}}


def cpu_in_turn(calls: list[tuple[Callable[[int], object], int]], rounds: int) -> list[float]:
    """Returns each loop's processor time per call, in microseconds.

    Each time is the best of several rounds, in which the loops alternate.
    """
    best = [np.inf] * len(calls)
    for number in range(rounds + 1):
        for k, (call, count) in enumerate(calls):
            start = time.process_time()
            for i in range(count):
                call(number * count + i)
            if number:  # the first round includes building the world and is not counted
                best[k] = min(best[k], time.process_time() - start)
    return [1e6 * seconds / count for seconds, (_, count) in zip(best, calls, strict=True)]


def place(i: int) -> list[float]:
    return [0.2 * np.sin(0.7 * i), 0.2 * np.cos(0.9 * i), 0.6]


def scene(levels: int, others: int, sky: int = 0, shining: int = 0) -> raycam.World:
    world = raycam.World()
    world.add_object(plane={"size": [12, 12]}, name="floor")
    world.add_object(**ball(levels), name="cup", location=[0, 0, 0.6])
    for i in range(others):
        x, y = i % 40, i // 40
        world.add_object(box={"size": 0.1}, location=[0.3 * x - 6, 0.3 * y - 6, 0.05])
    if sky:
        texels = np.random.default_rng(1).random((sky // 2, sky, 3), dtype=np.float32)
        world.add_light(type="environment", image=texels)
    if shining:
        world.add_object(**ball(shining), name="lamp", location=[2, 2, 3], emission=1.0)
    return world


def moved_cameras() -> list[raycam.Camera]:
    """Returns 64 cameras that move by the same distances as the object.

    Therefore, the same number of triangles is loaded into the cache.
    """
    return [camera(np.subtract(place(i), [0, 0, 0.6])) for i in range(64)]


def rows(rounds: int, calls: int) -> list[list[str]]:
    scenes = {
        "ball of 320 triangles, floor": scene(2, 0),
        "ball of 5,120 triangles, floor": scene(4, 0),
        "ball of 81,920 triangles, floor": scene(6, 0),
        "ball of 327,680 triangles, floor": scene(7, 0),
        "ball of 5,120 triangles and 10 boxes": scene(4, 10),
        "ball of 5,120 triangles and 1,000 boxes": scene(4, 1000),
        "ball of 5,120 triangles under a sky image of 4k": scene(4, 0, sky=4096),
        "ball of 5,120 triangles, 81,920 emissive triangles": scene(4, 0, shining=6),
    }
    cameras = moved_cameras()
    found = []
    for name, world in scenes.items():
        world.set_video(
            fps=24,
            seconds=1000,
            keyframe=[{"time": i, "object": "cup", "location": place(i)} for i in range(64)],
        )

        def depth(world: raycam.World, i: int = 0) -> object:
            return raycam.render(world, cameras[i % 64], channels="depth")

        def moved(i: int, world: raycam.World) -> None:
            world.set_object("cup", location=place(i))
            depth(world)

        few = max(3, calls // 20) if "1,000" in name else calls
        other = world.copy()  # a copy is changed instead of the world
        loops: list[Callable[[int], object]] = [
            lambda i, w=world: depth(w, i),
            lambda i, w=world: depth(w.at(i % 60 + 0.5)),
            lambda i, w=other: moved(i, w),
        ]
        still, moment, seen = cpu_in_turn([(loop, few) for loop in loops], rounds)
        found.append(
            [
                name,
                f"{still:.0f}",
                *(
                    f"{value:.{digits}f}"
                    for one in (moment, seen)
                    for value, digits in ((one, 0), (one / still, 2))
                ),
            ]
        )
    return found


def fresh() -> list[str]:
    """Returns notes on the processor time of the first images of new worlds."""
    notes = []
    for name, world in {
        "327,680 triangles": scene(7, 0),
        "a sky image of 4k": scene(4, 0, sky=4096),
        "81,920 emissive triangles": scene(4, 0, shining=6),
    }.items():
        world.set_video(fps=24, seconds=10, keyframe=[{"time": 0, "object": "cup", "location": [0, 0, 0.6]}])
        spent = []
        for i in range(4):
            start = time.process_time()
            raycam.render(world.at(0.1 * i), camera(), channels="depth")
            spent.append(f"{1e3 * (time.process_time() - start):.1f}")
        notes.append(
            f"First four depth images of a new world ({name}), at four times: {', '.join(spent)} ms."
        )
    return notes


def many(rounds: int) -> list[str]:
    """Compares a thousand poses in one call of `render_many` with the time of their rays.

    The time of the rays is that of images by a moving camera, without the fixed cost of a call.
    """
    notes = []
    cameras = moved_cameras()
    one = raycam.Camera.look_at([6, -6, 3], [0, 0, 0.5], [0, 0, 1], size=(1, 1), fov=40)
    matrices = np.tile(np.eye(4), (1000, 1, 1))
    matrices[:, :3, 3] = [place(i) for i in range(1000)]

    def depth(world: raycam.World, eye: raycam.Camera) -> object:
        return raycam.render(world, eye, channels="depth")

    for name, world in {"5,120": scene(4, 0), "81,920": scene(6, 0)}.items():
        loops: list[tuple[Callable[[int], object], int]] = [
            (
                lambda _, w=world: raycam.render_many(w, camera(), poses={"cup": matrices}, channels="depth"),
                1,
            ),
            (lambda i, w=world: depth(w, cameras[i % 64]), 200),
            (lambda _, w=world: depth(w, one), 200),
        ]
        together, apart, fixed = cpu_in_turn(loops, rounds)
        together /= 1000
        notes.append(
            f"1,000 poses with `render_many`, ball of {name} triangles: {together:.0f} µs per image; rays of "
            f"one image: {apart - fixed:.0f} µs (an image by a moved camera, {apart:.0f} µs, minus an image "
            f"of 1 x 1 pixels, {fixed:.0f} µs); ratio {together / (apart - fixed):.2f}."
        )
    return notes


def small() -> list[str]:
    world = scene(2, 0)
    one = raycam.Camera.look_at([6, -6, 3], [0, 0, 0.5], [0, 0, 1], size=(1, 1), fov=40)
    loops: list[tuple[Callable[[int], object], int]] = [
        (lambda _: world.cast_rays([0, 0, 9], [0, 0, -1]), 200),
        (lambda _: raycam.render(world, one, channels="depth"), 200),
    ]
    ray, pixel = cpu_in_turn(loops, 9)
    start = time.perf_counter()
    for _ in range(200):
        raycam.render(world, one, channels="depth")
    wall = (time.perf_counter() - start) / 200
    return [
        f"One ray: {ray:.0f} µs; a depth image of 1 x 1 pixels: {pixel:.0f} µs (elapsed time "
        f"{1e6 * wall:.0f} µs)."
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calls", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    notes = [*fresh(), *small(), *many(arguments.rounds)]
    head = ["scene", "camera moved", "world.at(t)", "ratio", "set_object", "ratio"]
    report.write(
        "edit", "Images after an object was moved", notes, head, rows(arguments.rounds, arguments.calls)
    )


if __name__ == "__main__":
    main()
