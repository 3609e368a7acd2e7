"""Worlds that change: a 64 x 64 depth picture after an object moved, beside the same with the camera moved as far.

Processor time of all threads a call, in microseconds, best of five. Every loop is the work of a user: tell the world
what moved, ask for the picture.
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


def cpu(call: Callable[[int], object], calls: int, rounds: int) -> float:
    """The processor time of a call in microseconds."""
    best = np.inf
    for number in range(rounds + 1):
        start = time.process_time()
        for i in range(calls):
            call(number * calls + i)
        if number:  # the first round builds
            best = min(best, time.process_time() - start)
    return 1e6 * best / calls


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


def rows(rounds: int, calls: int) -> list[list[str]]:
    scenes = {
        "ball of 320, floor": scene(2, 0),
        "ball of 5,120, floor": scene(4, 0),
        "ball of 81,920, floor": scene(6, 0),
        "ball of 327,680, floor": scene(7, 0),
        "ball of 5,120 and 10 boxes": scene(4, 10),
        "ball of 5,120 and 1,000 boxes": scene(4, 1000),
        "ball of 5,120 under a sky of 4k": scene(4, 0, sky=4096),
        "ball of 5,120, 81,920 shine": scene(4, 0, shining=6),
    }
    # Moved as far as the object is: as many triangles come into the cache.
    cameras = [camera(np.subtract(place(i), [0, 0, 0.6])) for i in range(64)]
    found = []
    for name, world in scenes.items():
        world.set_video(
            fps=24,
            seconds=1000,
            keyframe=[{"time": i, "object": "cup", "location": place(i)} for i in range(64)],
        )

        def depth(world: raycam.World, i: int = 0) -> object:
            return raycam.render(world, cameras[i % 64], channels="depth")

        few = max(3, calls // 20) if "1,000" in name else calls
        still = cpu(lambda i, w=world: depth(w, i), few, rounds)
        moment = cpu(lambda i, w=world: depth(w.at(i % 60 + 0.5)), few, rounds)
        line = [name, f"{still:.0f}", f"{moment:.0f}", f"{moment / still:.2f}"]
        if hasattr(world, "set_object"):

            def moved(i: int, world: raycam.World = world) -> object:
                world.set_object("cup", location=place(i))
                return depth(world)

            seen = cpu(moved, few, rounds)
            line += [f"{seen:.0f}", f"{seen / still:.2f}"]
        else:
            line += ["-", "-"]
        found.append(line)
    return found


def fresh() -> list[str]:
    """Seconds of a loop over moments of worlds that were never rendered themselves."""
    notes = []
    for name, world in {
        "327,680 triangles": scene(7, 0),
        "a sky of 4k": scene(4, 0, sky=4096),
        "81,920 that shine": scene(4, 0, shining=6),
    }.items():
        world.set_video(fps=24, seconds=10, keyframe=[{"time": 0, "object": "cup", "location": [0, 0, 0.6]}])
        spent = []
        for i in range(4):
            start = time.process_time()
            raycam.render(world.at(0.1 * i), camera(), channels="depth")
            spent.append(f"{1e3 * (time.process_time() - start):.1f}")
        notes.append(f"Depth of four moments of a world never rendered, {name}: {', '.join(spent)} ms.")
    return notes


def many(rounds: int) -> list[str]:
    """A thousand poses in one call beside the time of their rays: pictures without the fixed cost of a call."""
    notes = []
    one = raycam.Camera.look_at([6, -6, 3], [0, 0, 0.5], [0, 0, 1], size=(1, 1), fov=40)
    matrices = np.tile(np.eye(4), (1000, 1, 1))
    matrices[:, :3, 3] = [place(i) for i in range(1000)]

    def depth(world: raycam.World, eye: raycam.Camera) -> float:
        return cpu(lambda _: raycam.render(world, eye, channels="depth"), 200, rounds)

    def all_poses(world: raycam.World) -> float:
        poses = {"cup": matrices}
        return (
            cpu(lambda _: raycam.render_many(world, camera(), poses=poses, channels="depth"), 1, rounds)
            / 1000
        )

    for name, world in {"5,120": scene(4, 0), "81,920": scene(6, 0)}.items():
        together, apart, fixed = all_poses(world), depth(world, camera()), depth(world, one)
        notes.append(
            f"A thousand poses by render_many, ball of {name}: {together:.0f} a picture; its rays {apart - fixed:.0f} "
            f"(a picture {apart:.0f} less one of 1 x 1, {fixed:.0f}); ratio {together / (apart - fixed):.2f}."
        )
    return notes


def small() -> list[str]:
    world = scene(2, 0)
    one = raycam.Camera.look_at([6, -6, 3], [0, 0, 0.5], [0, 0, 1], size=(1, 1), fov=40)
    ray = cpu(lambda i: world.cast_rays([0, 0, 9], [0, 0, -1]), 200, 5)
    pixel = cpu(lambda i: raycam.render(world, one, channels="depth"), 200, 5)
    start = time.perf_counter()
    for _ in range(200):
        raycam.render(world, one, channels="depth")
    wall = (time.perf_counter() - start) / 200
    return [f"One ray {ray:.0f}, a depth picture of 1 x 1 {pixel:.0f} (wall {1e6 * wall:.0f})."]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calls", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    notes = [*fresh(), *small(), *many(arguments.rounds)]
    head = ["scene", "camera moved", "world.at(t)", "ratio", "set_object", "ratio"]
    report.write("edit", "An object moved", notes, head, rows(arguments.rounds, arguments.calls))


if __name__ == "__main__":
    main()
