"""Measures training images: colour, depth and ids of five moving meshes, in two processes.

    python benchmarks/bench_training.py [--pyrender INTERPRETER] [--open3d INTERPRETER] [--seconds 5]

Each process changes the poses of five balls of 20,480 triangles over a floor, and renders an image of 128 x 128 pixels
with one sample on one thread, like a worker of PyTorch's DataLoader. pyrender renders colour and depth with
OSMesa, and the ids in a second pass. Open3D casts rays for depth and ids, without colour; it builds its scene
again for each image, because its objects cannot be moved. The report contains images per second of elapsed
time, and images per second of processor time.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

SIDE = 128
BALLS = 5
EYE, TARGET, FIELD_OF_VIEW = (4.0, -5.0, 4.0), (0.0, 0.0, 0.0), 40.0


def place(image: int, ball: int) -> list[float]:
    """Returns the location of ball number `ball` in image number `image`."""
    return [ball - 2 + 0.2 * np.sin(0.7 * image + ball), 0.3 * np.cos(0.9 * image + 2 * ball), 0.5]


def raycam_images(integrator: str) -> Callable[[int], object]:
    """Returns a function that renders one image with raycam."""
    import raycam

    world = raycam.World()
    world.add_object(plane={"size": [6, 6]}, color=[0.5, 0.5, 0.5])
    for ball in range(BALLS):
        world.add_object(sphere={"radius": 0.4, "level": 5}, name=f"ball{ball}")
    world.add_light("sun", direction=[-1, 0.5, -2], irradiance=3)
    camera = raycam.Camera.look_at(EYE, TARGET, size=(SIDE, SIDE), fov=FIELD_OF_VIEW)

    def image(number: int) -> object:
        for ball in range(BALLS):
            world.set_object(f"ball{ball}", location=place(number, ball))
        channels = ["color", "depth", "instance"]
        return raycam.render(world, camera, integrator=integrator, channels=channels, samples=1, threads=1)

    return image


def ball_mesh() -> Any:
    """Returns the mesh of a ball, for pyrender and Open3D."""
    import trimesh

    return trimesh.creation.icosphere(subdivisions=5, radius=0.4)


def camera_pose() -> np.ndarray:
    """Returns world_from_camera [4, 4] in OpenGL's axes."""
    back = np.subtract(EYE, TARGET) / np.linalg.norm(np.subtract(EYE, TARGET))
    right = np.cross([0, 0, 1], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(back, right), back, EYE], axis=1)
    return pose


def pyrender_images(_: str) -> Callable[[int], object]:
    """Returns a function that renders one image with pyrender."""
    os.environ["PYOPENGL_PLATFORM"] = "osmesa"
    import pyrender
    import trimesh

    scene = pyrender.Scene()
    scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.box([6, 6, 0.01])))
    mesh = pyrender.Mesh.from_trimesh(ball_mesh())
    nodes = [scene.add(mesh) for _ in range(BALLS)]
    scene.add(pyrender.DirectionalLight(intensity=3.0), pose=camera_pose())
    scene.add(pyrender.PerspectiveCamera(yfov=np.radians(FIELD_OF_VIEW)), pose=camera_pose())
    renderer = pyrender.OffscreenRenderer(SIDE, SIDE)
    colors = {node: (number + 1, 0, 0) for number, node in enumerate(nodes)}

    def image(number: int) -> object:
        for ball, node in enumerate(nodes):
            pose = np.eye(4)
            pose[:3, 3] = place(number, ball)
            scene.set_pose(node, pose)
        color, depth = renderer.render(scene)
        ids, _ = renderer.render(scene, flags=pyrender.RenderFlags.SEG, seg_node_map=colors)
        return color, depth, ids

    return image


def open3d_images(_: str) -> Callable[[int], object]:
    """Returns a function that computes depth and ids with Open3D."""
    import open3d

    mesh = ball_mesh()
    vertices, faces = np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.uint32)
    corners = np.array([[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]], np.float32)
    floor = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    tensor = open3d.core.Tensor
    focal = SIDE / 2 / np.tan(np.radians(FIELD_OF_VIEW) / 2)
    offset = (np.arange(SIDE) + 0.5 - SIDE / 2) / focal
    x, y = np.meshgrid(offset, -offset)
    directions = np.stack([x, y, -np.ones_like(x)], axis=-1) @ camera_pose()[:3, :3].T
    rays = tensor(
        np.concatenate([np.broadcast_to(EYE, directions.shape), directions], axis=-1).astype(np.float32)
    )

    def image(number: int) -> object:
        scene = open3d.t.geometry.RaycastingScene(nthreads=1)
        scene.add_triangles(tensor(corners), tensor(floor))
        for ball in range(BALLS):
            scene.add_triangles(tensor(vertices + np.float32(place(number, ball))), tensor(faces))
        found = scene.cast_rays(rays, nthreads=1)
        return found["t_hit"].numpy(), found["geometry_ids"].numpy()

    return image


IMAGES = {"raycam": raycam_images, "pyrender": pyrender_images, "open3d": open3d_images}


def work(renderer: str, integrator: str, seconds: float) -> None:
    """Renders for `seconds`; prints the number of images, the elapsed and the processor time."""
    image = IMAGES[renderer](integrator)
    for number in range(10):
        image(number)
    print("ready", flush=True)
    sys.stdin.readline()
    start, used, count = time.perf_counter(), time.process_time(), 0
    while time.perf_counter() - start < seconds:
        image(count)
        count += 1
    print(json.dumps([count, time.perf_counter() - start, time.process_time() - used]))


def measure(
    python: str, renderer: str, integrator: str, seconds: float, processes: int
) -> tuple[float, float]:
    """Returns images per second of elapsed time (all processes) and of processor time."""
    command = [python, str(Path(__file__)), "--work", renderer, integrator, "--seconds", str(seconds)]
    limits = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "LP_NUM_THREADS"), "1")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    workers = [subprocess.Popen(command, env={**os.environ, **limits}, **pipes) for _ in range(processes)]
    for worker in workers:
        if worker.stdout.readline() != "ready\n":
            raise SystemExit(f"{renderer}: the process ended before its first image; its error is above")
    for worker in workers:
        worker.stdin.write("\n")
        worker.stdin.flush()
    found = [json.loads(worker.communicate()[0]) for worker in workers]
    return sum(count / elapsed for count, elapsed, _ in found), sum(n for n, _, _ in found) / sum(
        used for _, _, used in found
    )


def main() -> None:
    """Measures all renderers in turn."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pyrender", help="Python interpreter with pyrender, trimesh and OSMesa")
    parser.add_argument("--open3d", help="Python interpreter with Open3D and trimesh")
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--work", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.work:
        work(*options.work, options.seconds)
        return
    import report

    cases = [(sys.executable, "raycam", "flat"), (sys.executable, "raycam", "direct")]
    cases += [(options.pyrender, "pyrender", "")] * bool(options.pyrender)
    cases += [(options.open3d, "open3d", "")] * bool(options.open3d)
    found: dict[tuple[str, ...], list[tuple[float, float]]] = {case: [] for case in cases}
    for _ in range(options.rounds):
        for case in cases:
            found[case].append(measure(*case, options.seconds, options.processes))
    rows = [
        [f"{renderer} {integrator}".strip()]
        + [f"{function(one[i] for one in values):.0f}" for i in (0, 1) for function in (max, median)]
        for (_, renderer, integrator), values in found.items()
    ]
    head = ["renderer", "images/s, best", "median", "images per processor second, best", "median"]
    notes = [
        f"{options.processes} processes per renderer; {options.rounds} rounds of {options.seconds:g} s, "
        "in which the renderers alternate."
    ]
    report.write("training", "Images for training", notes, head, rows)


def median(values: Any) -> float:
    """Returns the median."""
    return float(np.median(list(values)))


if __name__ == "__main__":
    main()
