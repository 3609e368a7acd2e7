"""Compares the time of raycam and other renderers for a flat image, depth and ids.

The mesh has 1.3 million triangles. The renderers run in alternation.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import report

SIZE = (1024, 768)
EYE, TARGET, FOV = (2.3, 1.4, 1.0), (0.0, 0.0, 0.0), 45.0
Picture = Callable[[], object]
# Added to K for renderers in which the centre of the first pixel is at (0.5, 0.5).
HALF_PIXEL = np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])


def rock(level: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns a sphere of 20 * 4**level triangles, roughened by seven octaves of waves."""
    golden = (1 + 5**0.5) / 2
    points = [(s, t * golden, 0) for s in (-1, 1) for t in (-1, 1)]
    vertices = np.array([np.roll(point, k) for k in range(3) for point in points], float)
    near = np.linalg.norm(vertices[:, None] - vertices, axis=2).round(9) == 2
    faces = np.array(
        [
            (a, b, c)
            for a in range(12)
            for b in range(a)
            for c in range(b)
            if near[a, b] & near[b, c] & near[a, c]
        ]
    )
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
    faces[inward] = faces[inward][:, ::-1]
    for _ in range(level):
        edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        unique, middle = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = (middle.reshape(-1, 3) + len(vertices)).T
        vertices = np.concatenate([vertices, vertices[unique].mean(axis=1)])
        a, b, c = faces.T
        faces = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    random = np.random.default_rng(seed)
    radius = np.ones(len(vertices))
    for octave in range(7):
        for _ in range(4):
            wave = random.normal(size=3)
            phase = 2**octave * 4 * vertices @ (wave / np.linalg.norm(wave)) + random.uniform(0, 2 * np.pi)
            radius += 0.06 / 2**octave * np.sin(phase)
    return vertices * radius[:, None], faces


def camera_matrices() -> tuple[np.ndarray, np.ndarray]:
    """Returns K with OpenCV's pixel centres, and camera_from_world."""
    focal = SIZE[1] / 2 / np.tan(np.radians(FOV) / 2)
    K = np.array([[focal, 0, (SIZE[0] - 1) / 2], [0, focal, (SIZE[1] - 1) / 2], [0, 0, 1]])
    forward = np.subtract(TARGET, EYE) / np.linalg.norm(np.subtract(TARGET, EYE))
    right = np.cross(forward, (0, 0, 1)) / np.linalg.norm(np.cross(forward, (0, 0, 1)))
    camera_from_world = np.eye(4)
    camera_from_world[:3, :3] = right, np.cross(forward, right), forward
    camera_from_world[:3, 3] = -camera_from_world[:3, :3] @ EYE
    return K, camera_from_world


def pinhole_rays() -> tuple[np.ndarray, np.ndarray]:
    """Returns origins and directions of all pixels, row by row, with z = 1 in camera axes."""
    K, camera_from_world = camera_matrices()
    u, v = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    directions = (
        np.stack([u, v, np.ones_like(u)], -1).reshape(-1, 3) @ np.linalg.inv(K).T @ camera_from_world[:3, :3]
    )
    return np.broadcast_to(np.array(EYE), directions.shape).copy(), directions


def raycam_picture(vertices: np.ndarray, faces: np.ndarray) -> Picture:
    import raycam

    world = raycam.World()
    world.add_mesh(vertices, faces, material={"color": [0.6, 0.5, 0.4]})
    K, camera_from_world = camera_matrices()
    camera = raycam.Camera(K, R=camera_from_world[:3, :3], C=EYE, size=SIZE)
    channels = ["color", "depth", "instance", "triangle"]
    return lambda: raycam.render(world, camera, integrator="flat", samples=1, channels=channels)


def raycam_rays(vertices: np.ndarray, faces: np.ndarray) -> Picture:
    import raycam

    world = raycam.World()
    world.add_mesh(vertices, faces)
    origins, directions = pinhole_rays()
    return lambda: world.cast_rays(origins, directions)


def open3d_rays(vertices: np.ndarray, faces: np.ndarray) -> Picture:
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        open3d.core.Tensor(vertices.astype(np.float32)), open3d.core.Tensor(faces.astype(np.uint32))
    )
    K, camera_from_world = camera_matrices()
    rays = scene.create_rays_pinhole(
        open3d.core.Tensor(K + HALF_PIXEL), open3d.core.Tensor(camera_from_world), SIZE[0], SIZE[1]
    )
    return lambda: scene.cast_rays(rays)


def trimesh_rays(vertices: np.ndarray, faces: np.ndarray) -> Picture:
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    caster = trimesh.ray.ray_pyembree.RayMeshIntersector(mesh)
    origins, directions = pinhole_rays()
    return lambda: caster.intersects_first(origins, directions)


def pyrender_picture(vertices: np.ndarray, faces: np.ndarray) -> Picture:
    os.environ["PYOPENGL_PLATFORM"] = "osmesa"
    np.infty = np.inf  # noqa: NPY201 - pyrender uses this name, which NumPy 2 has removed
    import pyrender

    scene = pyrender.Scene(ambient_light=[1.0, 1.0, 1.0])
    scene.add(
        pyrender.Mesh([pyrender.Primitive(vertices.astype(np.float32), indices=faces.astype(np.uint32))])
    )
    K, camera_from_world = camera_matrices()
    K = K + HALF_PIXEL
    world_from_gl = np.linalg.inv(camera_from_world) @ np.diag([1, -1, -1, 1])
    scene.add(pyrender.IntrinsicsCamera(K[0, 0], K[1, 1], K[0, 2], K[1, 2]), pose=world_from_gl)
    renderer = pyrender.OffscreenRenderer(*SIZE)
    return lambda: renderer.render(scene, flags=pyrender.RenderFlags.FLAT)


CONTENDERS = {
    "raycam": ("raycam.render: colour, depth, object and triangle ids", raycam_picture),
    "raycam-rays": ("raycam cast_rays: all its results, with float64 rays", raycam_rays),
    "open3d": ("Open3D cast_rays: all its results, without colour; rays are created in advance", open3d_rays),
    "trimesh": ("trimesh with embreex, intersects_first: only triangle ids", trimesh_rays),
    "pyrender": ("pyrender with OSMesa, flat: colour and depth; no ids", pyrender_picture),
}


def work(name: str, mesh: str) -> None:
    """Runs in a separate process: prepares the world, then renders an image per line of stdin.

    Prints the seconds of each image.
    """
    with np.load(mesh) as arrays:
        picture = CONTENDERS[name][1](arrays["vertices"], arrays["faces"])
    picture()
    print("ready", flush=True)
    for _ in sys.stdin:
        start = time.perf_counter()
        picture()
        print(time.perf_counter() - start, flush=True)


def race(names: list[str], mesh: str, rounds: int, peers: str | None) -> dict[str, list[float]]:
    """Returns the seconds of each image by renderer.

    Each renderer runs in a process of its own; the processes render in alternation. Renderers that do not
    start are omitted.
    """
    workers, seconds = {}, {}
    for name in names:
        python = sys.executable if name.startswith("raycam") else peers or sys.executable
        command = [python, __file__, "--worker", name, mesh]
        worker = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        if worker.stdout.readline() == "ready\n":
            workers[name], seconds[name] = worker, []
        else:
            print(f"{name} does not start on this machine", file=sys.stderr)
    for _ in range(rounds):
        for name, worker in workers.items():
            worker.stdin.write("\n")
            worker.stdin.flush()
            seconds[name].append(float(worker.stdout.readline()))
    for worker in workers.values():
        worker.stdin.close()
        worker.wait()
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=9, help="images per program; the programs take turns")
    parser.add_argument(
        "--level",
        type=int,
        default=8,
        help="subdivision level of the rock, which has 20 * 4**LEVEL triangles",
    )
    parser.add_argument("--seed", type=int, default=1, help="seed of the rock's shape")
    parser.add_argument("--peers", help="Python interpreter with the other programs")
    parser.add_argument("--only", nargs="+", choices=CONTENDERS, default=list(CONTENDERS))
    parser.add_argument("--worker", nargs=2, metavar=("NAME", "MESH"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        work(*options.worker)
        return

    vertices, faces = rock(options.level, options.seed)
    with tempfile.TemporaryDirectory() as folder:
        mesh = str(Path(folder, "rock.npz"))
        np.savez(mesh, vertices=vertices, faces=faces)
        seconds = race(options.only, mesh, options.rounds, options.peers)

    ours = report.spread(seconds["raycam"])[1] if "raycam" in seconds else float("nan")
    rows = []
    for name, times in seconds.items():
        best, median = report.spread(times)
        rows.append([CONTENDERS[name][0], f"{best:.3f}", f"{median:.3f}", f"{median / ours:.2f}"])
    notes = [
        f"{SIZE[0]} x {SIZE[1]} pixels with one ray each, of a generated rock (seed {options.seed}) of"
        f" {len(faces):,} triangles, already prepared. Seconds, {options.rounds} rounds in alternation."
    ]
    report.write("flat_picture", "A flat image", notes, ["what", "best", "median", "times raycam"], rows)


if __name__ == "__main__":
    main()
